#pragma once
#include "whirl/io/json.hpp"
#include "whirl/pipeline/monte_carlo.hpp"
#include "whirl/report/document.hpp"
#include "whirl/report/table.hpp"

namespace whirl {

/// Quantiles of the peak and the probabilities with their intervals.
report::Table monte_carlo_table(const MonteCarloResult& result, const MonteCarloOptions& options);

/// whirl.robustness/1
Json to_json(const MonteCarloResult& result, const MonteCarloOptions& options);

/// Table, histogram of the peaks with the limit, peak against drawn stiffness.
report::Document monte_carlo_report(const MonteCarloResult& result, const MonteCarloOptions& options,
                                    const ControllerDesign& design, const Provenance& provenance);

}  // namespace whirl
