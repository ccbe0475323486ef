#include "terms/term.hpp"

/// A high-pass of both probes, of the first order, and the same of the second.
namespace whirl::identification::terms {
namespace {

/// Derivative of what the probes give by the damping, or by the spring, of their high-pass.
Eigen::VectorXcd by_corner(const ProbePoint& at, bool square) {
  const detail::HighPass corner = detail::high_pass_of(at.sensor, at.dt);
  const Eigen::Index n = at.main.size();
  Eigen::VectorXcd rate = detail::high_passed_rate(at.main + at.sensor.cubic * detail::cubes(at.main), corner, square) +
                          at.charge * detail::discharge_rate(n, corner, false, square);
  if (at.charge_rate != 0.0) rate += at.charge_rate * detail::discharge_rate(n, corner, true, square);
  return read_by_both(at, (square ? at.dt * at.dt : at.dt) * rate);
}

}  // namespace

const TermEntry& ac_coupling() {
  static const TermEntry entry{
      .label = "AC coupling",
      .parameters = {{"sensor_high_pass", "rad/s"}},
      .sensor = &SensorAxes::high_pass,
      .reading = [](const ProbePoint& at) { return by_corner(at, false); },
      .not_negative = true,
      .charge = "charge",
      .decider = Decider::dc_coupling,
  };
  return entry;
}

const TermEntry& ac_coupling_twice() {
  static const TermEntry entry{
      .label = "AC coupling of second order",
      .parameters = {{"sensor_high_pass_square", "rad^2/s^2"}},
      .sensor = &SensorAxes::high_pass_square,
      .reading = [](const ProbePoint& at) { return by_corner(at, true); },
      .not_negative = true,
      .after = ac_coupling,
      // One of the second order that turns the phase as much (Butterworth): what they leave of the size of the motion
      // differs, and that is e and k2.
      .start = [](SensorAxes& axes) { axes.high_pass_square = 0.5 * axes.high_pass * axes.high_pass; },
      .charge = "charge_rate",
      .decider = Decider::dc_coupling,
  };
  return entry;
}

}  // namespace whirl::identification::terms
