#include "whirl/signal/window.hpp"

#include <cmath>
#include <numbers>

#include "whirl/core/error.hpp"

namespace whirl::signal {

Eigen::VectorXd window(Window kind, Eigen::Index n) {
  Eigen::VectorXd w = Eigen::VectorXd::Ones(n);
  if (kind == Window::rectangular) return w;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double phase = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
    if (kind == Window::hann) {
      w[i] = 0.5 - 0.5 * std::cos(phase);
    } else {
      // ISO 18431-2 flat top: amplitude error of a sine between lines below 0.1 %.
      w[i] = 1 - 1.933 * std::cos(phase) + 1.286 * std::cos(2 * phase) - 0.388 * std::cos(3 * phase) +
             0.0322 * std::cos(4 * phase);
    }
  }
  return w;
}

double noise_bandwidth(const Eigen::Ref<const Eigen::VectorXd>& w) {
  return static_cast<double>(w.size()) * w.squaredNorm() / (w.sum() * w.sum());
}

Eigen::VectorXd force_window(Eigen::Index n, Eigen::Index end, Eigen::Index taper) {
  Eigen::VectorXd w = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < std::min(n, end + taper); ++i) {
    w[i] = i < end ? 1.0
                   : 0.5 + 0.5 * std::cos(std::numbers::pi * static_cast<double>(i - end + 1) /
                                          static_cast<double>(taper + 1));
  }
  return w;
}

Eigen::VectorXd exponential_window(Eigen::Index n, double dt, double decay) {
  require_range("exponential window decay", decay, 0, 1e9, "1/s");
  Eigen::VectorXd w(n);
  for (Eigen::Index i = 0; i < n; ++i) w[i] = std::exp(-decay * dt * static_cast<double>(i));
  return w;
}

}  // namespace whirl::signal
