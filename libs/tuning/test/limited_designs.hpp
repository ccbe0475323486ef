#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "whirl/testing/control/limited_machine.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

/// What identification and data sheets say of the machine that a design is made for, with their errors.
inline Hardware data_sheets(const testing::LimitedMachine& m) {
  rig::RigParameters p;
  p.profile = {.omega_start = m.from, .omega_end = m.to, .ramp_time = m.ramp, .dwell_end = m.still};
  p.laser.noise = m.noise;
  // The plants of a design look at whole Runge-Kutta steps.
  p.laser.rate = 0;
  p.laser.latency = 0.25e-3 * std::max(1.0, std::round((m.age + m.sensor_lag) / 0.25e-3));
  p.actuator.force_per_volt = m.force_limit / p.actuator.voltage_limit;
  p.actuator.bandwidth = 1 / (2 * std::numbers::pi * m.lag);
  p.actuator.delay_samples = static_cast<int>(std::lround(m.delay / testing::LimitedRig::kTick));
  p.actuator.slew = m.slew;
  p.actuator.hysteresis = m.hysteresis;
  p.encoder.counts = 4096;
  Hardware h = data_sheet(p);
  h.modes.push_back({m.second_hertz, m.second_damping, std::abs(m.second_share), m.second_share < 0 ? -1.0 : 1.0, 0});
  return h;
}

inline ControllerDesign designed(const testing::LimitedMachine& m, const char* law, const char* estimator,
                                 int evaluations) {
  IdentifiedModel model;
  model.method = "stand-in";
  RotorModel& r = model.rotor.emplace();
  r.k1 = 1.01 * m.stiffness / m.mass;
  r.k2 = m.cubic / m.mass;
  r.c = 1.15 * m.damping / m.mass;
  r.gain = 1 / m.mass;
  r.eps = std::polar(0.97 * m.unbalance, m.unbalance_angle + 0.04);
  DesignOptions o;
  o.law = law;
  o.estimator = estimator;
  o.feedforward = !std::string(law).starts_with("pd_");
  o.hardware = data_sheets(m);
  o.evaluations = evaluations;
  o.threads = 1;
  return design(model, o);
}

}  // namespace whirl::tuning
