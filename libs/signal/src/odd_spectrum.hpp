#pragma once
#include <Eigen/Core>
#include <complex>

namespace whirl::signal {

/// Spectrum of the odd continuation (period 2 (N - 1)) of x minus the line through its end points.
struct OddSpectrum {
  double start = 0, slope = 0;  ///< line removed: start + slope * sample
  Eigen::VectorXcd lines;       ///< N lines, 0 .. 2 (N - 1) / 2
};

OddSpectrum odd_spectrum(const Eigen::Ref<const Eigen::VectorXd>& x);
/// Inverse real transform of length 2 (lines.size() - 1), first `count` samples.
Eigen::VectorXd inverse_spectrum(const Eigen::VectorXcd& lines, Eigen::Index count);

}  // namespace whirl::signal
