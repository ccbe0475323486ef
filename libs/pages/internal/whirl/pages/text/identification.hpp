#pragma once
#include <string>

#include "whirl/identify/identify.hpp"
#include "whirl/report/table.hpp"

namespace whirl::pages {

/// Method, equations with intervals (those that only define a rate left out), parameters and timing of inputs.
std::string to_text(const IdentifiedModel& model);
/// Chi-square, condition number, bounds, collinear groups, what is assumed or not told apart, held-out error.
std::string to_text(const identification::Evidence& evidence, const Summary& summary,
                    const std::vector<Ambiguity>& ambiguities = {});

/// Regression methods on the same data: terms, residual, condition, free-run error, time.
report::Table comparison_table(const identification::MethodComparison& comparison);
/// Free-run errors of each record: of a rotor in mm with the band of a right model, of other systems in SI.
report::Table validation_table(const identification::ValidationReport& report);

}  // namespace whirl::pages
