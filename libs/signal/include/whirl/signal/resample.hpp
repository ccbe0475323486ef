#pragma once
#include <Eigen/Core>

namespace whirl::signal {

/// Band-limited interpolation on a grid `factor` times finer: result of size (N - 1) factor + 1, entry i*factor = x_i.
///
/// Spectrum of the odd continuation about the line through the end points, padded with zeros. Exact for a signal
/// without content above half the sample rate, apart from the end effect (below 1e-3 of the amplitude 20 samples
/// inside). factor >= 1, N >= 3. Used before differencing at few samples per cycle, and for the midpoints of
/// Runge-Kutta steps.
Eigen::VectorXd upsample(const Eigen::Ref<const Eigen::VectorXd>& x, int factor);

}  // namespace whirl::signal
