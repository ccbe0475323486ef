#include "period.hpp"

#include <cmath>

#include "whirl/signal/fft.hpp"

namespace whirl::modal {

Eigen::Index period_of(const Eigen::Ref<const Eigen::VectorXd>& signal) {
  using Eigen::Index;
  using Eigen::VectorXd;
  constexpr double kAlike = 0.98, kApart = 0.5;
  const Index n = signal.size();
  VectorXd padded = VectorXd::Zero(signal::fast_fft_length(2 * n));
  padded.head(n) = signal.array() - signal.mean();
  VectorXd sums(n + 1);  // of squares
  sums[0] = 0;
  for (Index i = 0; i < n; ++i) sums[i + 1] = sums[i] + padded[i] * padded[i];
  if (!(sums[n] > 0)) return 0;
  const Eigen::VectorXcd spectrum = signal::fft(padded.cast<std::complex<double>>());
  const VectorXd products = signal::inverse_fft(spectrum.cwiseAbs2().cast<std::complex<double>>()).real();
  const auto alike = [&](Index lag) {
    return products[lag] / std::sqrt(std::max(1e-300, sums[n - lag] * (sums[n] - sums[lag])));
  };
  Index lag = 1;
  while (lag <= n / 2 && alike(lag) > kApart) ++lag;  // a slow signal is like itself for a while
  for (; lag <= n / 2; ++lag) {
    if (alike(lag) < kAlike) continue;
    while (lag < n / 2 && alike(lag + 1) > alike(lag)) ++lag;
    return lag;
  }
  return 0;
}

}  // namespace whirl::modal
