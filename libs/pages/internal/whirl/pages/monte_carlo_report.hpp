#pragma once
#include "whirl/io/json.hpp"
#include "whirl/report/document.hpp"
#include "whirl/report/table.hpp"
#include "whirl/tuning/monte_carlo.hpp"

namespace whirl::pages {

/// Quantiles of the peak and the probabilities with their intervals.
report::Table monte_carlo_table(const tuning::MonteCarloResult& result, const tuning::MonteCarloOptions& options);

/// whirl.robustness/1
io::Json to_json(const tuning::MonteCarloResult& result, const tuning::MonteCarloOptions& options);

/// Table, histogram of the peaks with the limit, peak against drawn stiffness.
report::Document monte_carlo_report(const tuning::MonteCarloResult& result, const tuning::MonteCarloOptions& options,
                                    const ControllerDesign& design, const Provenance& provenance);

}  // namespace whirl::pages
