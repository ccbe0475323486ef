#pragma once
#include <Eigen/Core>

namespace whirl::signal {

/// Discrete Fourier transform X_k = sum_n x_n e^{-j 2 pi k n / N}, any length N >= 1. Not scaled. Thread-safe.
Eigen::VectorXcd fft(const Eigen::Ref<const Eigen::VectorXcd>& x);
/// Inverse of `fft`, scaled by 1/N.
Eigen::VectorXcd inverse_fft(const Eigen::Ref<const Eigen::VectorXcd>& spectrum);

/// One-sided transform of a real signal: the first N/2 + 1 lines of `fft`.
Eigen::VectorXcd real_fft(const Eigen::Ref<const Eigen::VectorXd>& x);

/// Smallest length >= n whose only prime factors are 2, 3 and 5 (fast transforms).
Eigen::Index fast_fft_length(Eigen::Index n);

}  // namespace whirl::signal
