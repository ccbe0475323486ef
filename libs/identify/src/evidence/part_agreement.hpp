#pragma once
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification::detail {

/// Whether the records, and the beginning, middle and end of each, ask for the same coefficients. Where they do not
/// the model gets a warning that names the term on which they differ most, loses its trust, and every interval grows to
/// what the parts ask for.
///
/// Runs of some periods with free starts give gradient and information of the likelihood at the model's coefficients.
/// Sums over parts of the records then differ by more than those over the runs inside a part do (F test of scores:
/// Rao, Proc. Camb. Phil. Soc. 44, 1948), so that coloured noise is no difference, and the scatter of the sums gives
/// intervals that hold under it (White, Econometrica 48, 1980; Liang and Zeger, Biometrika 73, 1986). Models with
/// states that no channel shows, with tied coefficients or without free ones, maps, and records of fewer than two runs
/// are left as they are.
void judge_parts(const std::vector<Recording>& records, const SindyOptions& options, IdentifiedModel& model);

}  // namespace whirl::identification::detail
