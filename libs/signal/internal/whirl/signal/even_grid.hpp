#pragma once
#include <Eigen/Core>

namespace whirl::signal {

/// Readings `x` at increasing, uneven times `t` (s) as readings at the instants start + k step, k = 0 .. rows - 1.
///
/// Every reading is moved along the motion to the next free instant beside it: by the difference, between there and its
/// own time, of a smoothing spline that leaves the noise. So its noise stays as it was, white where it was white, which
/// a curve through the readings would make smaller between them and correlated. An instant to which none is moved (two
/// steps away at most) lies on the curve; of two readings at one instant the mean is taken. Readings whose noise is
/// below 1e-4 of their spread, or fewer than 32, are read off the cubic spline through them; a channel that stands
/// still in more than half of its steps (held output, pulses) keeps its last reading up to the next. NaN outside of the
/// times.
///
/// Motion sampled at 10 instants a period or more. Throws Error unless x and t are equally long (two at least), times
/// increase and step > 0.
Eigen::VectorXd onto_even_grid(const Eigen::Ref<const Eigen::VectorXd>& t, const Eigen::Ref<const Eigen::VectorXd>& x,
                               double start, double step, Eigen::Index rows);

/// The least step from `step` to twice it (s) on whose grid readings at increasing times `t` leave at most 5 % of the
/// instants empty in onto_even_grid: what lies on the curve there has no noise. Throws
/// Error for times and steps as onto_even_grid does.
double even_step(const Eigen::Ref<const Eigen::VectorXd>& t, double step);

}  // namespace whirl::signal
