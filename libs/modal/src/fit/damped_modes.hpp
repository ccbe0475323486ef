#pragma once
#include <optional>

#include "white_fit.hpp"

namespace whirl::modal {

/// Largest damping ratio that is looked for: beyond it a mode hardly differs from two real poles.
constexpr double kHeaviestDamping = 0.7;

/// Whether modes of more than `options.poles.max_damping`/2 come back from model order to model order: their bells are
/// so wide that the tolerances and the limit of damping of a usual diagram leave them out.
bool shows_heavy_damping(const FrequencyResponse& frf, const ModeOptions& options);

/// A fit whose poles and residual terms were chosen together.
struct DampedFit {
  Refined state;
  ResidualTerms terms;
};

/// Modes of any damping up to kHeaviestDamping, for few modes that overlap: no diagram shows them stable, since their
/// poles move more from order to order than they stand apart. The poles of every model order are refined by
/// Gauss-Newton, those that do not pay are dropped one by one, and the shortest description is taken, with as many
/// residual terms as pay. Empty where no order describes the lines.
std::optional<DampedFit> fit_damped(const FrequencyResponse& frf, const Band& band, const ModeOptions& options);

}  // namespace whirl::modal
