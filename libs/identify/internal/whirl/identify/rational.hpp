#pragma once
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification {

/// Sparse identification of x' = N(x, u) / (1 + D(x, u)): enzymes, friction laws, saturations. N of the terms of
/// `options.library`, D of `options.equations.denominators`, each equation with its own.
///
/// 1. Implicit rows x' = N - D x' on smoothed records; the best subset of every size (as SINDy-PI: Kaheman, Kutz and
///    Brunton 2020, with x' itself as left-hand side) gives supports.
/// 2. The likeliest supports are fitted on free runs (fit_trajectory): there no derivative of data is needed and the
///    residual is white when the model is right. The smallest BIC wins;
///    a denominator that changes sign within the records never does.
/// 3. Terms of N and D below `options.search.t_value` go, absent ones with a score of at least t_value^2 come, until
/// neither
///    changes.
///
/// Equations are written with their denominator in numbers; its coefficients are the parameters "x' denominator: x".
/// Order 1 without ties; a system of several states is refined together. Summary as fit_sindy. Throws Error for
/// unknown names, order 2 and maps.
IdentifiedModel fit_rational(const std::vector<Recording>& records, const SindyOptions& options);

}  // namespace whirl::identification
