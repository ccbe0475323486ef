#pragma once
#include "whirl/identify/identify.hpp"

namespace whirl::identification::detail {

/// The verdict on a model by its own summary and all evidence; sets `summary` and model.summary.
void judge_evidence(Identification& identification);

}  // namespace whirl::identification::detail
