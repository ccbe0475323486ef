#pragma once
#include <string>
#include <vector>

#include "whirl/io/json.hpp"
#include "whirl/report/document.hpp"
#include "whirl/report/table.hpp"
#include "whirl/tuning/compare.hpp"

namespace whirl::pages {

/// A comparison with what is drawn beside it.
struct Comparison {
  rig::RigParameters rig;
  std::vector<tuning::ComparedResult> results;
  std::vector<tuning::FloorCase> floor;  ///< of the best result
  std::string command_line;
  Provenance provenance;
};

/// Peaks and suppression in the segments of paper Table 4 with the paper's row first, the whole run over all seeds,
/// standstill, effort, excess total variation, saturation; balanced case of Fig. 18 when it was run.
report::Table comparison_table(const Comparison& c);

/// Robustness matrix: whole-run peak in um per method and condition; FAILS marks runs that are not stable (standing
/// limit cycle or offset, divergence, trip, saturated more than 30 % of the time).
report::Table matrix_table(const Comparison& c);

/// The same in short: per method the conditions it fails in.
report::Table failures_table(const Comparison& c);

report::Table floor_table(const Comparison& c);

/// whirl.comparison/1
io::Json to_json(const Comparison& c);

/// The page: tables, effort against peak, segments against the paper, time traces of the best method, of eq. 43 and of
/// PD, all with the physical floor drawn in.
report::Document comparison_report(const Comparison& c);

}  // namespace whirl::pages
