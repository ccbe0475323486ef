#include <cmath>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/signal/derivative.hpp"

namespace whirl::signal {

SmoothedSignal smoothing_spline(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double lambda) {
  const Eigen::Index n = x.size();
  if (n < 4) throw Error::in_field("samples to smooth", std::to_string(n), "at least 4");
  if (!(lambda >= 0)) throw Error::in_field("spline smoothing lambda", std::to_string(lambda), "at least 0");
  // gamma = g'' at the inner knots: (R + lambda Q'Q) gamma = Q'x, g = x - lambda Q gamma (Green and Silverman 1994,
  // eq. 2.12).
  const Eigen::Index m = n - 2;
  const double q2 = 1 / (dt * dt);
  Eigen::VectorXd d0 = Eigen::VectorXd::Constant(m, 2 * dt / 3 + 6 * lambda * q2);
  Eigen::VectorXd d1 = Eigen::VectorXd::Constant(m, dt / 6 - 4 * lambda * q2);
  Eigen::VectorXd d2 = Eigen::VectorXd::Constant(m, lambda * q2);
  Eigen::VectorXd gamma = Eigen::VectorXd::Zero(n);
  auto inner = gamma.segment(1, m);
  inner = (x.segment(2, m) - 2 * x.segment(1, m) + x.head(m)) / dt;
  for (Eigen::Index i = 0; i < m; ++i) {
    const double l1 = d1[i] / d0[i], l2 = d2[i] / d0[i];
    if (i + 1 < m) {
      d0[i + 1] -= l1 * d1[i];
      d1[i + 1] -= l1 * d2[i];
      inner[i + 1] -= l1 * inner[i];
    }
    if (i + 2 < m) {
      d0[i + 2] -= l2 * d2[i];
      inner[i + 2] -= l2 * inner[i];
    }
  }
  for (Eigen::Index i = m - 1; i >= 0; --i) {
    double v = inner[i];
    if (i + 1 < m) v -= d1[i] * inner[i + 1];
    if (i + 2 < m) v -= d2[i] * inner[i + 2];
    inner[i] = v / d0[i];
  }
  SmoothedSignal s;
  s.value = x;
  s.value.head(m) -= lambda / dt * inner;
  s.value.segment(1, m) += 2 * lambda / dt * inner;
  s.value.tail(m) -= lambda / dt * inner;
  s.second = gamma;
  s.first.resize(n);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    s.first[i] = (s.value[i + 1] - s.value[i]) / dt - dt / 6 * (2 * gamma[i] + gamma[i + 1]);
  }
  s.first[n - 1] = (s.value[n - 1] - s.value[n - 2]) / dt + dt / 6 * (2 * gamma[n - 1] + gamma[n - 2]);
  return s;
}

SmoothedSignal smoothing_spline_for_noise(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double noise_sd) {
  if (!(noise_sd >= 0)) throw Error::in_field("noise sd", std::to_string(noise_sd), "at least 0");
  // The residual grows with lambda: bisect in log(lambda / dt^3), which runs from no smoothing to a straight line.
  double low = -12, high = 24;
  const double rows = std::sqrt(static_cast<double>(x.size()));
  for (int it = 0; it < 40; ++it) {
    const double mid = 0.5 * (low + high);
    const SmoothedSignal s = smoothing_spline(x, dt, std::pow(10.0, mid) * dt * dt * dt);
    ((s.value - x).norm() / rows < noise_sd ? low : high) = mid;
  }
  return smoothing_spline(x, dt, std::pow(10.0, low) * dt * dt * dt);
}

}  // namespace whirl::signal
