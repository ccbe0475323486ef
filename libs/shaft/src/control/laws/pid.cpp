#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "control/laws/law.hpp"
#include "whirl/core/error.hpp"

namespace whirl::shaft {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;

// Rate of the integral, parts of the frequency: far enough below it to leave its phase alone.
constexpr double kIntegral = 0.1;
// Of a unit displacement along the actuator: what the probes of a place may miss of it, by rounding of their angles.
constexpr double kMissed = 1e-6;

/// Weights of the readings that give the displacement along the actuator: of the probes at the nearest place that can.
RowVectorXd along(const Actuator& a, const std::vector<Probe>& probes) {
  const auto away = [&](double place) { return std::abs(place - a.a.position); };
  const auto nearer = [&](double one, double two) { return std::pair(away(one), one) < std::pair(away(two), two); };
  std::set<double, decltype(nearer)> places(nearer);
  for (const Probe& p : probes) places.insert(p.position);
  const Eigen::Vector2d wanted(std::cos(a.angle), std::sin(a.angle));
  for (const double place : places) {
    Eigen::Matrix2Xd directions = Eigen::Matrix2Xd::Zero(2, static_cast<Index>(probes.size()));
    for (std::size_t k = 0; k < probes.size(); ++k)
      if (probes[k].position == place)
        directions.col(static_cast<Index>(k)) << std::cos(probes[k].angle), std::sin(probes[k].angle);
    // A little of the identity, for probes that all look one way: they read what is along it.
    constexpr double kLittle = 1e-12;
    const Eigen::Matrix2d square = directions * directions.transpose() + kLittle * Eigen::Matrix2d::Identity();
    const RowVectorXd weights = (directions.transpose() * square.inverse() * wanted).transpose();
    if ((directions * weights.transpose() - wanted).norm() < kMissed) return weights;
  }
  throw Error(
      fmt::format("actuator '{}': no probe reads along it. The law 'pid' needs a [[probe]] of its angle, or two of "
                  "different angles at one position. The law 'lqg' needs neither",
                  a.name));
}

/// Each actuator on its own, from the displacement y beside it, the same at every speed:
///
///   F = -(m w^2 - k) y - 2 zeta m w dy/dt - 0.1 m w^3 integral of y,
///
/// w the frequency, zeta the damping ratio, m the mass whose displacement the actuators move most readily, k the bias
/// stiffness (Schweitzer and Maslen, Magnetic Bearings, 2009, ch. 2). The integral carries the rotor: only with a
/// magnet. The derivative is that of a first-order low-pass whose corner is a multiple of w: by its phase, modes far
/// above w are damped or driven.
std::vector<ControlGains> pid_gains(const LawTask& task, const std::vector<double>& numbers) {
  const double frequency = numbers[0], damping = numbers[1], corner = numbers[2];
  const double step = task.sample_time, mass = 1 / std::pow(task.plants.front().push, 2);
  const double late = 1 / (corner * frequency), part = 1 - std::exp(-step / late);
  // States of an actuator: displacement, its low-pass, of a magnet its integral.
  const auto carries = [](const Actuator& a) { return a.bias_stiffness < 0; };
  const Index count = static_cast<Index>(task.actuators.size()),
              n = 2 * count + std::ranges::count_if(task.actuators, carries);
  ControlGains g{task.speeds.front(), MatrixXd::Zero(n, n), MatrixXd::Zero(n, static_cast<Index>(task.probes.size())),
                 MatrixXd::Zero(n, count), MatrixXd::Zero(count, n)};
  for (Index j = 0, at = 0; j < count; ++j) {
    const Actuator& a = task.actuators[static_cast<std::size_t>(j)];
    const RowVectorXd weights = along(a, task.probes);
    g.readings.row(at) = weights;
    g.readings.row(at + 1) = part * weights;
    g.advance(at + 1, at + 1) = 1 - part;
    const double spring = mass * frequency * frequency;
    // Exact for a displacement that grows evenly.
    const double rate = 2 * damping * mass * frequency * part / ((1 - part) * step);
    g.feedback(j, at) = spring - a.bias_stiffness + rate;
    g.feedback(j, at + 1) = -rate;
    at += 2;
    if (!carries(a)) continue;
    g.readings.row(at) = step * weights;
    g.advance(at, at) = 1;
    g.feedback(j, at) = kIntegral * frequency * spring;
    ++at;
  }
  std::vector<ControlGains> out{g};
  if (task.speeds.size() > 1) {
    out.push_back(g);
    out.back().speed = task.speeds.back();
  }
  return out;
}

}  // namespace

const Law kPid{"pid",
               {{"frequency", "1/s", 1e-4, 0.1, 10}, {"damping_ratio", "", 0.1, 5, 6}, {"corner_ratio", "", 3, 100, 4}},
               [](const LawTask& task) -> LawGains {
                 return [&task](const std::vector<double>& numbers) { return pid_gains(task, numbers); };
               }};

}  // namespace whirl::shaft
