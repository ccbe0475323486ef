#pragma once
#include <string>

#include "whirl/core/modal_model.hpp"
#include "whirl/io/geometry.hpp"
#include "whirl/modal/checks.hpp"
#include "whirl/modal/poles.hpp"

namespace whirl::pages {

/// A page of a modal test, in one file without anything from outside: the stabilisation diagram, where a click adds or
/// removes a pole and the command with `--select` follows; the shapes, moving, on the geometry or, without one, along a
/// line; MAC matrix; complexity of every shape; every FRF with its fit and residual. `command`: the one that made it.
std::string modal_page(const FrequencyResponse& frf, const ModalModel& model, const modal::ModeShapes& shapes,
                       const modal::StabilisationDiagram& diagram, const io::Geometry& geometry,
                       const std::string& command);

}  // namespace whirl::pages
