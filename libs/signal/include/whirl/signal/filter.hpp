#pragma once
#include <Eigen/Core>

namespace whirl::signal {

/// Gaussian smoothing (paper section IV-A): convolution with exp(-t^2 / (2 sd^2)), cut at 4 sd. A tone of w rad/s is
/// attenuated by exp(-(w sd)^2 / 2). Same size as x; near the ends the kernel is cut and normalised again, so the first
/// and last 4 sd samples are biased: see gaussian_reach(). `sd` in samples, >= 0 (0 returns x).
Eigen::VectorXd gaussian_filter(const Eigen::Ref<const Eigen::VectorXd>& x, double sd);
/// Every column of x alike ("filter the equation": one kernel on measured and library columns keeps it true).
Eigen::MatrixXd gaussian_filter_columns(const Eigen::Ref<const Eigen::MatrixXd>& x, double sd);
/// Samples at each end that the cut kernel touches.
Eigen::Index gaussian_reach(double sd);

}  // namespace whirl::signal
