#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "whirl/core/angles.hpp"
#include "whirl/shaft/fit/order_run.hpp"

namespace whirl::shaft {

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

/// One step of c' = m c + b(t), b linear between its ends: c_1 = g c_0 + w_0 b_0 + w_1 b_1.
struct StepWeights {
  std::complex<double> growth, first, last;
  StepWeights(std::complex<double> m, double h) {
    const std::complex<double> z = m * h;
    growth = std::exp(z);
    std::complex<double> one, two;  // (e^z - 1) / z, (e^z - 1 - z) / z^2
    if (std::abs(z) < 1e-2) {
      one = 1.0 + z / 2.0 + z * z / 6.0 + z * z * z / 24.0;
      two = 0.5 + z / 6.0 + z * z / 24.0 + z * z * z / 120.0;
    } else {
      one = (growth - 1.0) / z;
      two = (one - 1.0) / z;
    }
    first = h * (one - two);
    last = h * two;
  }
};

/// What the ends of a step of the grid weigh in the sums of a record: the trapezoid, and the end that `signal::
/// order_vectors` leaves out, whose 64 samples a turn begin at the turn's first. (Exact sums of e^{2 i theta} with c
/// straight between the points were tried: chi-square of runs below the second critical speed falls from 1.4 to 1.05,
/// but the errors of damping in runs through both double.)
struct SampleWeights {
  static constexpr double kEnd = 0.5 * kGridPerTurn / 64;
  static constexpr double first = 0.5 + kEnd, last = 0.5 - kEnd;           ///< of c
  std::array<std::complex<double>, kGridPerTurn> first_twice, last_twice;  ///< of c e^{2 i theta}, by step of a turn

  SampleWeights() {
    for (std::size_t k = 0; k < kGridPerTurn; ++k) {
      first_twice[k] = std::polar(first, 2 * kTwoPi * static_cast<double>(k) / kGridPerTurn);
      last_twice[k] = std::polar(last, 2 * kTwoPi * static_cast<double>(k + 1) / kGridPerTurn);
    }
  }
};

}  // namespace whirl::shaft
