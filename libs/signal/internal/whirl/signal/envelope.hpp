#pragma once
#include <Eigen/Core>

namespace whirl::signal {

/// Analytic signal x + j H(x) by the transform (Hilbert, one-sided spectrum). Ends suffer where x is not periodic.
Eigen::VectorXcd analytic_signal(const Eigen::Ref<const Eigen::VectorXd>& x);

/// Magnitude of the analytic signal of x without its mean: the peak amplitude of a narrow-band signal over time.
Eigen::VectorXd envelope(const Eigen::Ref<const Eigen::VectorXd>& x);

}  // namespace whirl::signal
