#pragma once
#include <cmath>
#include <numbers>
#include <string>

#include "rig_design.hpp"
#include "whirl/testing/control/foreign_rig.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

/// What an identification of the foreign machine gives, with its errors.
inline IdentifiedModel identified(const testing::ForeignMachine& m) {
  IdentifiedModel model;
  model.method = "stand-in";
  model.rotor.emplace();
  RotorModel& r = *model.rotor;
  r.k1 = 1.01 * m.stiffness / m.mass;
  r.k2 = m.cubic / m.mass;
  r.c = 1.2 * m.damping / m.mass;
  r.gain = 1 / m.mass;
  r.eps = std::polar(0.97 * m.unbalance, m.unbalance_angle + 0.05);
  return model;
}

inline Hardware data_sheets(const testing::ForeignMachine& m) {
  rig::RigParameters p;
  p.profile = {.omega_start = m.top, .omega_end = 0, .ramp_time = m.down, .dwell_end = m.still};
  p.laser.noise = m.noise;
  p.laser.latency = m.age;
  p.actuator.force_per_volt = m.force_limit / p.actuator.voltage_limit;
  p.actuator.bandwidth = 1 / (2 * std::numbers::pi * m.lag);
  p.actuator.delay_samples = static_cast<int>(std::lround(m.delay / testing::ForeignRig::kTick));
  p.encoder.counts = m.counts;
  Hardware h = data_sheet(p);
  for (const testing::ForeignMode& mode : m.modes) {
    const double share = mode.participation(m.mass);
    h.modes.push_back({mode.hertz, mode.damping, std::abs(share), share < 0 ? -1.0 : 1.0, 0});
  }
  return h;
}

inline DesignOptions options_for(const testing::ForeignMachine& m, const char* law, const char* estimator) {
  DesignOptions o;
  o.law = law;
  o.estimator = estimator;
  o.feedforward = !std::string(law).starts_with("pd_");
  o.hardware = data_sheets(m);
  return o;
}

inline ControllerDesign designed(const testing::ForeignMachine& m, const char* law, const char* estimator,
                                 int evaluations = 12) {
  DesignOptions o = options_for(m, law, estimator);
  o.evaluations = evaluations;
  return design(identified(m), o);
}

/// With the numbers that a search starts from, and the supervision of a design; no certificate.
inline ControllerDesign watched_design(const testing::ForeignMachine& m, const char* law, const char* estimator) {
  return watched_design(identified(m), options_for(m, law, estimator));
}

}  // namespace whirl::tuning
