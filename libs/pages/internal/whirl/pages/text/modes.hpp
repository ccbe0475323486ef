#pragma once
#include <string>

#include "whirl/core/modal_model.hpp"
#include "whirl/io/json.hpp"
#include "whirl/modal/fdd.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/frf.hpp"
#include "whirl/modal/oma.hpp"
#include "whirl/report/figure.hpp"
#include "whirl/report/table.hpp"

namespace whirl::pages {

/// Frequency and damping with standard deviations, and how real each shape is.
report::Table modes_table(const ModalModel& modes);
report::Table modes_table(const modal::OperationalModes& found);
report::Table modes_table(const modal::AmbientModes& found);
/// Modes against those of an earlier test over the same points.
report::Table change_table(const ModalModel& modes, const ModalModel& before);
/// A line for each mode whose pole depends on the amplitude, and what its distortion adds.
std::vector<std::string> amplitude_lines(const ModalModel& modes);
/// Blows and what was found of each.
report::Table blows_table(const std::vector<modal::BlowReport>& blows);

/// What a figure's file name asks for: "frf" the first FRF with its reconstruction, "shape" the shapes, else the
/// stabilisation diagram. Throws Error where there are no shapes.
report::Figure modes_figure(const std::string& file, const FrequencyResponse& frf, const ModalModel& modes,
                            const modal::PoleOptions& options);
report::Figure shapes_figure(const modal::OperationalModes& found);
/// Singular values of the spectral matrix over frequency, modes marked.
report::Figure singular_values_figure(const modal::AmbientModes& found);

/// whirl.operational_modes/1
io::Json to_json(const modal::OperationalModes& found);
/// whirl.ambient_modes/1
io::Json to_json(const modal::AmbientModes& found);

}  // namespace whirl::pages
