#pragma once
#include <string>

#include "whirl/io/json.hpp"
#include "whirl/lagrange/lagrange_file.hpp"
#include "whirl/lagrange/physical.hpp"

namespace whirl::pages {

/// Equations of motion, accelerations and library of a derivation, for people.
std::string derivation_text(const lagrange::LagrangeFile& file, const lagrange::LagrangeEquations& equations);
/// The equations as a LaTeX `aligned`.
std::string derivation_latex(const lagrange::LagrangeEquations& equations);
/// whirl.derivation/1 without parameters, summary and provenance (docs/formats.md).
io::Json to_json(const lagrange::LagrangeFile& file, const lagrange::LagrangeEquations& equations);

/// Parameters, combinations and what was asked for, one line each with 95 % intervals.
std::string parameters_text(const lagrange::PhysicalParameters& found);
/// Sets their members of whirl.derivation/1.
void add_parameters(io::Json& document, const lagrange::PhysicalParameters& found);

}  // namespace whirl::pages
