#pragma once
#include <vector>

#include "terms/growing_model.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/score_test.hpp"

namespace whirl::identification::detail {

/// The growth test of score_rotor_terms for records whose readings the weak equations do not take (velocity,
/// acceleration): each candidate of `growth` is set beside the model at 0, and its columns are the derivatives of the
/// free runs (Rao 1948). Places count the whole lists of `growth`. `chi_square` is that of the free runs. Not tried:
/// errors of displacement probes, forces that begin at one instant, forces that a model cannot hold. `fit` must come
/// from `records` with `growth.active`.
ScoreTest score_on_free_runs(const std::vector<RotorRecord>& records, const OutputErrorFit& fit, const Growth& growth,
                             const RotorIdentifyOptions& options);

}  // namespace whirl::identification::detail
