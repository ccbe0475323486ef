#include "whirl/shaft/control/controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Complex = std::complex<double>;

namespace {

/// Entry below `speed` of a table and the part of the way to the next.
template <class Entry>
std::pair<std::size_t, double> place(const std::vector<Entry>& table, double speed) {
  if (table.size() < 2 || speed <= table.front().speed) return {0, 0};
  if (speed >= table.back().speed) return {table.size() - 2, 1};
  const auto above = std::ranges::upper_bound(table, speed, {}, &Entry::speed);
  const auto k = static_cast<std::size_t>(above - table.begin()) - 1;
  return {k, (speed - table[k].speed) / (table[k + 1].speed - table[k].speed)};
}

template <class Matrix, class Entry>
Matrix between(const std::vector<Entry>& table, const std::pair<std::size_t, double>& at, Matrix Entry::*part) {
  if (table.size() == 1) return table.front().*part;
  return (1 - at.second) * (table[at.first].*part) + at.second * (table[at.first + 1].*part);
}

}  // namespace

ControlGains RotorController::at(double speed) const {
  const auto where = place(gains, speed);
  return {speed, between(gains, where, &ControlGains::advance), between(gains, where, &ControlGains::readings),
          between(gains, where, &ControlGains::forces), between(gains, where, &ControlGains::feedback)};
}

SynchronousGains RotorController::synchronous_at(double speed) const {
  const auto where = place(synchronous, speed);
  return {speed, between(synchronous, where, &SynchronousGains::correction),
          between(synchronous, where, &SynchronousGains::relief), between(synchronous, where, &SynchronousGains::start),
          between(synchronous, where, &SynchronousGains::most)};
}

void check(const RotorController& c) {
  require_range("controller.sample_time", c.sample_time, 1e-7, 10, "s");
  require_range("controller.adaptation", c.adaptation, 0, 0.5 / c.sample_time, "1/s");
  const auto m = static_cast<Index>(c.actuators.size()), p = static_cast<Index>(c.probes.size());
  if (m == 0 || p == 0 || c.gains.empty() || c.synchronous.empty())
    throw Error("the controller needs a probe, an actuator and gains of at least one speed");
  const auto shape = [](const auto& matrix, Index rows, Index cols, const char* name) {
    if (matrix.rows() != rows || matrix.cols() != cols || !matrix.allFinite())
      throw Error::in_field(name, fmt::format("{} x {}", matrix.rows(), matrix.cols()),
                            fmt::format("{} x {} finite numbers", rows, cols));
  };
  const Index n = c.states();
  for (const ControlGains& g : c.gains) {
    shape(g.advance, n, n, "controller.gains.advance");
    shape(g.readings, n, p, "controller.gains.readings");
    shape(g.forces, n, m, "controller.gains.forces");
    shape(g.feedback, m, n, "controller.gains.feedback");
  }
  for (const SynchronousGains& g : c.synchronous) {
    shape(g.correction, m, p, "controller.synchronous.correction");
    shape(g.relief, m, m, "controller.synchronous.relief");
    shape(g.start, m, 1, "controller.synchronous.start");
    shape(g.most, m, 1, "controller.synchronous.most");
  }
  const auto ascends = [](const auto& table) {
    return std::ranges::adjacent_find(table, [](const auto& a, const auto& b) { return !(a.speed < b.speed); }) ==
           table.end();
  };
  if (!ascends(c.gains) || !ascends(c.synchronous)) throw Error("the speeds of a controller must ascend");
}

double turning_floor(const RotorController& c) { return std::max(1e-6, std::pow(0.1 * c.synchronous.back().speed, 2)); }

RotorControl::RotorControl(RotorController controller) : c_(std::move(controller)) {
  check(c_);
  const auto m = static_cast<Index>(c_.actuators.size());
  state_ = Eigen::VectorXd::Zero(c_.states());
  force_ = wanted_ = Eigen::VectorXd::Zero(m);
  adapted_ = vector_ = Eigen::VectorXcd::Zero(m);
  slow_ = turning_floor(c_);
}

void RotorControl::turn(const Eigen::VectorXd& readings, double angle, double speed) {
  const SynchronousGains g = c_.synchronous_at(speed);
  const double square = speed * speed + slow_;
  // A vector per speed^2 stays as it is while the speed changes; at low speed, where it is small, it is a force.
  adapted_ -= 2 * c_.adaptation * c_.sample_time / square * std::polar(1.0, -angle) *
              (g.correction * readings.cast<Complex>() + g.relief * force_.cast<Complex>());
  vector_ = g.start + square * adapted_;
  for (Index j = 0; j < vector_.size(); ++j)
    if (std::abs(vector_[j]) > g.most[j]) vector_[j] *= g.most[j] / std::abs(vector_[j]);
  adapted_ = (vector_ - g.start) / square;
}

const Eigen::VectorXd& RotorControl::step(const Eigen::VectorXd& seen, double angle, double speed) {
  Eigen::VectorXd readings = seen;
  for (std::size_t k = 0; k < c_.probes.size(); ++k) readings[static_cast<Index>(k)] -= c_.probes[k].runout_at(angle);
  const ControlGains g = c_.at(speed);
  state_ = (g.advance * state_ + g.readings * readings + g.forces * force_).eval();
  turn(readings, angle, speed);
  wanted_ = (vector_ * std::polar(1.0, angle)).real() - g.feedback * state_;
  for (Index j = 0; j < force_.size(); ++j) {
    const Actuator& a = c_.actuators[static_cast<std::size_t>(j)];
    const double rate = a.slew > 0 ? a.slew * c_.sample_time : 2 * a.force_limit;
    force_[j] = std::clamp(std::clamp(wanted_[j], force_[j] - rate, force_[j] + rate), -a.force_limit, a.force_limit);
  }
  return force_;
}

}  // namespace whirl::shaft
