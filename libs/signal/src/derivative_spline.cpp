#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/signal/derivative.hpp"

namespace whirl::signal {
namespace {

/// gamma = g'' at the inner knots: (R + lambda Q'Q) gamma = Q'x, g = x - lambda Q gamma (Green and Silverman 1994,
/// eq. 2.12). The matrix has five diagonals.
class Curvatures {
 public:
  Curvatures(const Eigen::Ref<const Eigen::VectorXd>& x, double dt)
      : dt_(dt),
        m_(x.size() - 2),
        right_((x.segment(2, m_) - 2 * x.segment(1, m_) + x.head(m_)) / dt),
        inverse_(m_),
        beside_(m_),
        gamma_(Eigen::VectorXd::Zero(m_ + 2)) {}

  /// gamma, 0 at both ends.
  const Eigen::VectorXd& at(double lambda) {
    const double q2 = 1 / (dt_ * dt_), d0 = 2 * dt_ / 3 + 6 * lambda * q2, d1 = dt_ / 6 - 4 * lambda * q2,
                 d2 = lambda * q2;
    auto inner = gamma_.segment(1, m_);
    // What the two rows before take off this one.
    double off0 = 0, next0 = 0, off1 = 0, off = 0, next = 0;
    for (Eigen::Index i = 0; i < m_; ++i) {
      const double inverse = 1 / (d0 - off0), near = d1 - off1, value = right_[i] - off;
      const double l1 = near * inverse, l2 = d2 * inverse;
      inverse_[i] = inverse;
      beside_[i] = near;
      inner[i] = value;
      off0 = next0 + l1 * near;
      next0 = l2 * d2;
      off1 = l1 * d2;
      off = next + l1 * value;
      next = l2 * value;
    }
    double after = 0, second = 0;
    for (Eigen::Index i = m_ - 1; i >= 0; --i) {
      const double value = (inner[i] - beside_[i] * after - d2 * second) * inverse_[i];
      inner[i] = value;
      second = after;
      after = value;
    }
    return gamma_;
  }
  /// rms of x - g.
  double residual(double lambda) {
    const Eigen::VectorXd& g = at(lambda);
    double sum = 0;
    for (Eigen::Index i = 0; i < g.size(); ++i) {
      const double before = i > 0 ? g[i - 1] : 0, after = i + 1 < g.size() ? g[i + 1] : 0;
      const double bend = before - 2 * g[i] + after;
      sum += bend * bend;
    }
    return lambda / dt_ * std::sqrt(sum / static_cast<double>(g.size()));
  }

 private:
  double dt_;
  Eigen::Index m_;
  Eigen::VectorXd right_, inverse_, beside_, gamma_;
};

void check_samples(Eigen::Index n) {
  if (n < 4) throw Error::in_field("samples to smooth", std::to_string(n), "at least 4");
}

}  // namespace

SmoothedSignal smoothing_spline(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double lambda) {
  const Eigen::Index n = x.size(), m = n - 2;
  check_samples(n);
  if (!(lambda >= 0)) throw Error::in_field("spline smoothing lambda", std::to_string(lambda), "at least 0");
  SmoothedSignal s;
  s.second = Curvatures(x, dt).at(lambda);
  const Eigen::VectorXd& gamma = s.second;
  const auto inner = gamma.segment(1, m);
  s.value = x;
  s.value.head(m) -= lambda / dt * inner;
  s.value.segment(1, m) += 2 * lambda / dt * inner;
  s.value.tail(m) -= lambda / dt * inner;
  s.first.resize(n);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    s.first[i] = (s.value[i + 1] - s.value[i]) / dt - dt / 6 * (2 * gamma[i] + gamma[i + 1]);
  }
  s.first[n - 1] = (s.value[n - 1] - s.value[n - 2]) / dt + dt / 6 * (2 * gamma[n - 1] + gamma[n - 2]);
  return s;
}

SmoothedSignal smoothing_spline_for_noise(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double noise_sd) {
  // log10(lambda / dt^3), from no smoothing to a straight line; the residual grows with it.
  constexpr double kLow = -12, kHigh = 24, kNear = 1e-9;
  constexpr std::uintmax_t kMostSteps = 60;
  check_samples(x.size());
  if (!(noise_sd >= 0)) throw Error::in_field("noise sd", std::to_string(noise_sd), "at least 0");
  const auto lambda = [&](double log) { return std::pow(10.0, log) * dt * dt * dt; };
  Curvatures curvatures(x, dt);
  const auto above = [&](double log) {
    return std::log(std::max(curvatures.residual(lambda(log)), 1e-300) / std::max(noise_sd, 1e-300));
  };
  const double at_low = above(kLow), at_high = above(kHigh);
  if (!(at_low < 0)) return smoothing_spline(x, dt, lambda(kLow));
  if (!(at_high > 0)) return smoothing_spline(x, dt, lambda(kHigh));
  std::uintmax_t steps = kMostSteps;
  const auto near = [](double a, double b) { return b - a < kNear; };
  return smoothing_spline(
      x, dt, lambda(boost::math::tools::toms748_solve(above, kLow, kHigh, at_low, at_high, near, steps).first));
}

}  // namespace whirl::signal
