#include "whirl/signal/envelope.hpp"

#include "whirl/signal/fft.hpp"

namespace whirl::signal {

Eigen::VectorXcd analytic_signal(const Eigen::Ref<const Eigen::VectorXd>& x) {
  const Eigen::Index n = x.size();
  Eigen::VectorXcd lines = fft(x.cast<std::complex<double>>());
  const Eigen::Index positive = (n - 1) / 2;
  lines.segment(1, positive) *= 2;
  lines.tail(positive).setZero();
  return inverse_fft(lines);
}

Eigen::VectorXd envelope(const Eigen::Ref<const Eigen::VectorXd>& x) {
  return analytic_signal(Eigen::VectorXd(x.array() - x.mean())).cwiseAbs();
}

}  // namespace whirl::signal
