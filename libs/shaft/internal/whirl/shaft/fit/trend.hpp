#pragma once
#include <string>
#include <vector>

#include "whirl/io/json.hpp"
#include "whirl/shaft/fit/fit.hpp"
#include "whirl/shaft/fit/fit_json.hpp"

namespace whirl::shaft {

/// One unknown over the runs.
struct TrendRow {
  FitRow last;                   ///< name, kind and unit
  std::vector<Estimate> values;  ///< of each run; NaN where that run does not tell it
  Estimate change;               ///< from the first run to the last, as a part of the value at the first
  double deviations = 0;         ///< size of the change in standard deviations
  double chi_square = 1;         ///< of the values about their line; 1 for two of them
  bool changed = false;          ///< `deviations` is above FitTrend::limit
};

/// Is it getting worse? Every run fitted alone, and a straight line through each unknown.
struct FitTrend {
  std::vector<std::string> runs;
  std::vector<bool> explained;  ///< a run that contradicts the rotor file is left out
  std::vector<TrendRow> rows;   ///< stiffness and damping that two runs or more tell
  double limit = 0;  ///< standard deviations at which one of all rows is called changed falsely once in a hundred
  Summary summary;
};

/// Runs in the order of time. Errors of the drawing are alike in all runs and leave less of a change than the intervals
/// hold: a change is called rather too late than falsely. Throws Error for fewer than two runs.
FitTrend fit_trend(const Rotor& rotor, const FitSetup& setup, const std::vector<OrderRun>& runs,
                   const FitOptions& options = {});

/// `whirl.rotor_trend/1`.
io::Json to_json(const FitTrend& trend);

}  // namespace whirl::shaft
