#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace whirl::testing {

/// Marks on a shaft: arcs of the turn over which the probe is on its upper level.
struct Wheel {
  std::string name;
  std::vector<double> from, to;  ///< turns
  bool notch = false;            ///< the probe is down over the arcs instead
  int places = 1;                ///< a turn, with those that have no mark
};

inline Wheel wheel_of(std::string name, const std::vector<double>& at, double width, int places) {
  Wheel w{std::move(name), at, at, false, places};
  for (double& v : w.to) v += width;
  return w;
}

/// Evenly spaced teeth without those of `missing`, each off by up to `error` of the spacing.
inline Wheel toothed(std::string name, int places, const std::vector<int>& missing, double error,
                     std::mt19937_64& random) {
  std::uniform_real_distribution<double> off(-error, error);
  std::vector<double> at;
  for (int k = 0; k < places; ++k)
    if (std::find(missing.begin(), missing.end(), k) == missing.end()) at.push_back((k + 0.1 + off(random)) / places);
  return wheel_of(std::move(name), at, 0.4 / places, places);
}

/// Twelve wheels as they are found on machines.
inline std::vector<Wheel> wheels(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0, 1);
  const auto magnets = [&](int n, double error) {
    std::vector<double> at;
    for (int k = 0; k < n; ++k) at.push_back((k + 0.3 + error * (2 * u(random) - 1)) / n);
    return wheel_of(std::to_string(n) + " magnets", at, 0.06 / n, n);
  };
  std::vector<Wheel> out{wheel_of("one mark", {0.2}, 0.05, 1), wheel_of("notch", {0.2}, 0.06, 1),
                         wheel_of("both edges of a notch", {0.2, 0.26}, 0.015, 2)};
  out[1].notch = true;
  out.push_back(magnets(2, 0.15));
  out.push_back(magnets(3, 0.12));
  out.push_back(magnets(4, 0.15));
  out.push_back(magnets(7, 0.12));
  out.push_back(toothed("36-1", 36, {35}, 0, random));
  out.push_back(toothed("60-2", 60, {58, 59}, 0.005, random));
  out.push_back(toothed("24 teeth", 24, {}, 0.02, random));
  out.push_back(toothed("36-2-2-2", 36, {16, 17, 33, 34, 31, 30}, 0, random));
  std::vector<double> cam{0, 0.25, 0.5, 0.75, 0.08};
  std::sort(cam.begin(), cam.end());
  out.push_back(wheel_of("4+1", cam, 0.03, 5));
  return out;
}

/// A run of a machine: turns and speed (turns/s) at any time, from rest or not.
struct TachoRun {
  double seconds = 10, slow = 5, fast = 30, bend = 1, ripple = 0, ripple_hz = 0;
  bool down = false;

  double speed(double t) const {
    const double share = std::clamp(down ? 1 - t / seconds : t / seconds, 0.0, 1.0);
    return (slow + (fast - slow) * std::pow(share, bend)) *
           (1 + ripple * std::sin(2 * std::numbers::pi * ripple_hz * t));
  }
};

/// What the probe reads, and what it should have told.
struct TachoRecord {
  double dt = 0;
  Eigen::VectorXd volts, speed;  ///< at the samples; speed in turns/s
  Eigen::VectorXd turns;         ///< at the samples; whole at the zero of the wheel
  long lost = 0, added = 0;
};

/// `chance`: of each pulse to be lost, half as much of one to be added. The probe averages over `smear` samples (0: it
/// switches).
inline TachoRecord tacho_record(const Wheel& wheel, const TachoRun& run, double rate, double chance, double smear,
                                std::mt19937_64& random) {
  constexpr int kSteps = 8;  // of the integration in a sample
  std::uniform_real_distribution<double> u(0, 1);
  TachoRecord out;
  out.dt = 1 / rate;
  const auto n = static_cast<Eigen::Index>(run.seconds * rate);
  out.volts.resize(n), out.speed.resize(n), out.turns.resize(n);
  double turn = u(random);
  std::size_t arc = 0;
  bool inside_before = false, lost = false;
  double spark_from = -1, spark_to = -1, after = 0;
  std::vector<double> fine(static_cast<std::size_t>(n) * kSteps);
  for (Eigen::Index i = 0; i < n; ++i) {
    // Over a sample the speed is a parabola: its power and its sine are most of the cost.
    const double before = i == 0 ? run.speed(0) : after, half = run.speed((static_cast<double>(i) + 0.5) / rate);
    after = run.speed(static_cast<double>(i + 1) / rate);
    out.speed[i] = before;
    out.turns[i] = turn;
    for (int s = 0; s < kSteps; ++s) {
      const double t = (static_cast<double>(i) + static_cast<double>(s) / kSteps) / rate;
      const double part = turn - std::floor(turn);
      bool inside = false;
      const auto next = std::upper_bound(wheel.from.begin(), wheel.from.end(), part);
      if (next != wheel.from.begin()) {
        const auto a = static_cast<std::size_t>(next - wheel.from.begin()) - 1;
        if (part < wheel.to[a]) inside = true, arc = a;
      }
      const bool middle = t > 0.1 * run.seconds && t < 0.9 * run.seconds;
      if (inside && !inside_before) lost = middle && u(random) < chance, out.lost += lost;
      if (!inside && inside_before && middle && u(random) < 0.5 * chance) {
        const double gap =
            (wheel.from.size() > 1 ? wheel.to[arc] - wheel.from[arc] : 0.2) / std::max(run.speed(t), 1e-9);
        spark_from = t + 0.6 * gap;
        spark_to = spark_from + std::max(0.2 * gap, 2.5 / rate);
        ++out.added;
      }
      inside_before = inside;
      const bool spark = t >= spark_from && t < spark_to;
      fine[static_cast<std::size_t>(i) * kSteps + static_cast<std::size_t>(s)] =
          ((inside && !lost) || spark) != wheel.notch ? 5.0 : 0.0;
      const double share = (s + 0.5) / kSteps - 0.5;  // of the sample, from its middle
      turn += (half + share * (after - before) + 2 * share * share * (before - 2 * half + after)) / (kSteps * rate);
    }
  }
  const auto width = static_cast<long>(smear * kSteps);
  for (Eigen::Index i = 0; i < n; ++i) {
    const long at = static_cast<long>(i) * kSteps, last = static_cast<long>(fine.size()) - 1;
    double sum = 0;
    for (long s = -width; s <= width; ++s) sum += fine[static_cast<std::size_t>(std::clamp(at + s, 0L, last))];
    out.volts[i] = sum / static_cast<double>(2 * width + 1);
  }
  return out;
}

}  // namespace whirl::testing
