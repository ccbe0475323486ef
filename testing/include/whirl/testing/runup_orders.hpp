#pragma once
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::testing {

/// A structure that a machine on it excites while it runs up: unbalance at 1X, a force of constant size at 2X.
struct RunupOrdersOptions {
  std::vector<double> frequency{14.0, 21.5, 33.0, 52.0};  ///< Hz; the speed passes the first three
  double damping_low = 0.01, damping_high = 0.03;
  int channels = 4;
  double rate = 1000, duration = 240;     ///< Hz, s
  double speed_low = 5, speed_high = 40;  ///< Hz
  double second = 0.3;                    ///< size of the force at 2X over that of 1X at full speed
  double noise = 0.02;                    ///< of the rms of each channel
  bool down = false;                      ///< run-down
  unsigned structure = 1, seed = 1;
};

struct RunupOrders {
  std::vector<double> frequency, damping;
  std::vector<std::vector<double>> shape;  ///< per mode, per channel
  Recording recording;                     ///< displacements, m, and the angle, rad
};

/// Modal equations integrated in time (Runge and Kutta, fourth order, four steps a sample) under the forces that the
/// angle gives, with the tangential part of the unbalance.
inline RunupOrders make_runup_orders(const RunupOrdersOptions& o) {
  std::mt19937_64 structure(31ull * o.structure + 9), random(179424673ull * o.seed + o.structure);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  RunupOrders result;
  result.frequency = o.frequency;
  const std::size_t modes = o.frequency.size();
  std::vector<std::complex<double>> first(modes), second(modes);
  for (std::size_t k = 0; k < modes; ++k) {
    result.damping.push_back(o.damping_low * std::pow(o.damping_high / o.damping_low, uniform(structure)));
    result.shape.emplace_back();
    for (int c = 0; c < o.channels; ++c)
      result.shape.back().push_back((uniform(structure) < 0.5 ? -1 : 1) * (0.3 + 0.7 * uniform(structure)));
    first[k] = std::polar(0.3 + 0.7 * uniform(structure), 2 * std::numbers::pi * uniform(structure));
    second[k] = std::polar(0.3 + 0.7 * uniform(structure), 2 * std::numbers::pi * uniform(structure));
  }
  const double begin = 2 * std::numbers::pi * (o.down ? o.speed_high : o.speed_low);
  const double end = 2 * std::numbers::pi * (o.down ? o.speed_low : o.speed_high);
  const double alpha = (end - begin) / o.duration, full = std::max(begin, end);
  const auto angle = [&](double t) { return begin * t + alpha * t * t / 2; };
  const auto n = static_cast<Eigen::Index>(std::lround(o.rate * o.duration));
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(n, o.channels);
  constexpr int kSteps = 4;
  const double h = 1 / (o.rate * kSteps);
  // Of all modes at one time: what the angle gives is worked out once.
  struct Acting {
    std::complex<double> unbalance, second;
  };
  const auto acting = [&](double t) {
    const double speed = begin + alpha * t;
    const std::complex<double> turned = std::polar(1.0, angle(t));
    return Acting{std::complex<double>(speed * speed / (full * full), -alpha / (full * full)) * turned,
                  o.second * turned * turned};
  };
  std::vector<double> w(modes), damping(modes), x(modes, 0.0), v(modes, 0.0);
  for (std::size_t k = 0; k < modes; ++k) {
    w[k] = 2 * std::numbers::pi * o.frequency[k];
    damping[k] = 2 * result.damping[k] * w[k];
  }
  const auto advance = [&](std::size_t k, const Acting& from, const Acting& middle, const Acting& to) {
    const auto acceleration = [&](const Acting& f, double place, double rate) {
      return (first[k] * f.unbalance + second[k] * f.second).real() - damping[k] * rate - w[k] * w[k] * place;
    };
    const double a1 = acceleration(from, x[k], v[k]), v2 = v[k] + h / 2 * a1;
    const double a2 = acceleration(middle, x[k] + h / 2 * v[k], v2), v3 = v[k] + h / 2 * a2;
    const double a3 = acceleration(middle, x[k] + h / 2 * v2, v3), v4 = v[k] + h * a3;
    const double a4 = acceleration(to, x[k] + h * v3, v4);
    x[k] += h / 6 * (v[k] + 2 * v2 + 2 * v3 + v4);
    v[k] += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  };
  Acting from = acting(0);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < modes; ++k)
      for (int p = 0; p < o.channels; ++p) y(i, p) += result.shape[k][static_cast<std::size_t>(p)] * x[k];
    for (int s = 0; s < kSteps; ++s) {
      const double t = h * static_cast<double>(i * kSteps + s);
      const Acting middle = acting(t + h / 2), to = acting(t + h);
      for (std::size_t k = 0; k < modes; ++k) advance(k, from, middle, to);
      from = to;
    }
  }
  result.recording.dt = 1 / o.rate;
  result.recording.source = "run-up";
  for (int c = 0; c < o.channels; ++c) {
    const double rms = y.col(c).norm() / std::sqrt(static_cast<double>(n));
    for (Eigen::Index i = 0; i < n; ++i) y(i, c) += o.noise * rms * normal(random);
    result.recording.add("x" + std::to_string(c), Quantity::displacement, y.col(c));
  }
  Eigen::VectorXd beta(n);
  for (Eigen::Index i = 0; i < n; ++i) beta[i] = angle(static_cast<double>(i) / o.rate);
  result.recording.add("beta", Quantity::angle, beta);
  return result;
}

}  // namespace whirl::testing
