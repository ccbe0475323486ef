#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "whirl/core/angles.hpp"
#include "whirl/shaft/fit/order_run.hpp"

namespace whirl::shaft {

inline constexpr double kStepAngle = kTwoPi / kGridPerTurn;

/// The angle of a run as the modes feel it, at the points of its grid.
struct SweepPath {
  Eigen::VectorXd step, speed;        ///< between points: s, rad/s
  Eigen::VectorXd point_speed, rate;  ///< at points: rad/s, rad/s^2

  explicit SweepPath(const OrderRun& run) {
    const Eigen::Index n = run.time.size();
    step = run.time.tail(n - 1) - run.time.head(n - 1);
    speed = kTwoPi / kGridPerTurn * step.cwiseInverse();
    point_speed.resize(n);
    rate.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      // Over a whole turn: the angle of an encoder is rough from sample to sample.
      const Eigen::Index a = std::max<Eigen::Index>(0, i - kGridPerTurn / 2), b = std::min(n - 1, i + kGridPerTurn / 2);
      const Eigen::Index before = std::max<Eigen::Index>(0, a - kGridPerTurn / 2),
                         after = std::min(n - 1, b + kGridPerTurn / 2);
      const auto mean = [&](Eigen::Index from, Eigen::Index to) {
        return kTwoPi / kGridPerTurn * static_cast<double>(to - from) / (run.time[to] - run.time[from]);
      };
      const auto middle = [&](Eigen::Index from, Eigen::Index to) { return 0.5 * (run.time[to] + run.time[from]); };
      const double apart = middle(i, after) - middle(before, i);
      rate[i] = after > i && i > before && apart > 0 ? (mean(i, after) - mean(before, i)) / apart : 0;
    }
    // The ends, where one side is missing.
    for (Eigen::Index i = 0; i < kGridPerTurn; ++i) {
      rate[i] = rate[kGridPerTurn];
      rate[n - 1 - i] = rate[n - 1 - kGridPerTurn];
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index a = std::max<Eigen::Index>(0, i - kGridPerTurn / 2), b = std::min(n - 1, i + kGridPerTurn / 2);
      const double middle = 0.5 * (run.time[a] + run.time[b]);
      point_speed[i] = kTwoPi / kGridPerTurn * static_cast<double>(b - a) / (run.time[b] - run.time[a]) +
                       rate[i] * (run.time[i] - middle);
    }
  }
};

/// 1 / z of numbers far from the limits of their exponent, where the library's division would scale.
inline std::complex<double> inverse(std::complex<double> z) { return std::conj(z) / std::norm(z); }

/// phi_0 = e^z, phi_{k+1} = (phi_k - 1 / k!) / z.
struct PhiFunctions {
  std::complex<double> zero, one, two, three;
  explicit PhiFunctions(std::complex<double> z) : zero(std::exp(z)) {
    if (std::norm(z) < 1e-4) {
      one = 1.0 + z / 2.0 + z * z / 6.0 + z * z * z / 24.0 + z * z * z * z / 120.0;
      two = 0.5 + z / 6.0 + z * z / 24.0 + z * z * z / 120.0;
      three = 1.0 / 6.0 + z / 24.0 + z * z / 120.0 + z * z * z / 720.0;
    } else {
      const std::complex<double> part = inverse(z);
      one = (zero - 1.0) * part;
      two = (one - 1.0) * part;
      three = (two - 0.5) * part;
    }
  }
};

/// One step of c' = m c + b(t) over the time h, in which the shaft turns by `angle`; b is linear between its ends. All
/// of it is exact, so that a free oscillation far from the speed costs no accuracy:
///     c_1 = growth c_0 + first b_0 + last b_1,
/// the mean of c, and the mean of c e^{2 i theta} with theta from the step's begin.
struct StepWeights {
  struct Row {
    std::complex<double> state, first, last;
  };
  Row next, mean, twice;

  /// `m_h` is m times h; the angle of the step is kStepAngle.
  StepWeights(std::complex<double> m_h, double h) {
    const PhiFunctions phi(m_h);
    next = {phi.zero, h * (phi.one - phi.two), h * phi.two};
    mean = {phi.one, h * (phi.two - phi.three), h * phi.three};
    // (c e^{2 i theta})' = (m + 2 i Omega) c e^{2 i theta} + b e^{2 i theta}
    static const std::complex<double> turn(0, 2 * kStepAngle), end = std::exp(turn), all = (end - 1.0) / turn,
                                                               rising = (end - all) / turn;
    const std::complex<double> apart = inverse(m_h + turn);
    twice = {(end * next.state - 1.0) * apart, (end * next.first - h * (all - rising)) * apart,
             (end * next.last - h * rising) * apart};
  }
};

/// e^{2 i theta} at a step of the grid from a whole turn on.
inline std::complex<double> twice_turned(Eigen::Index step) {
  static const auto table = [] {
    std::array<std::complex<double>, kGridPerTurn> t;
    for (std::size_t i = 0; i < t.size(); ++i) t[i] = std::polar(1.0, 2 * kStepAngle * static_cast<double>(i));
    return t;
  }();
  return table[static_cast<std::size_t>(step % kGridPerTurn)];
}

/// What the sums of `signal::order_vectors` add to means: they hold 64 samples a turn from the first of a block on, not
/// the one at its end (Euler and Maclaurin). Times c at the begin less c at the end, over the turns of the block.
struct SampleSums {
  static constexpr double kSamples = 64;
  static constexpr double once = 0.5 / kSamples;
  static constexpr std::complex<double> twice{0.5 / kSamples, -kTwoPi / (6 * kSamples * kSamples)};
};

}  // namespace whirl::shaft
