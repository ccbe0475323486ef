#pragma once
#include <complex>

#include "whirl/core/identified_model.hpp"
#include "whirl/testing/machines.hpp"

namespace whirl::testing {

/// A machine of 14.5 Hz, linear damping 3 1/s and a hardening spring; tests add a force to it.
inline Machine machine() {
  Machine m;
  m.k = 5700, m.cubic = 1.5e8, m.c = 3, m.e = 1e-4, m.e_phase = 0.7;
  return m;
}

/// The machine as `whirl identify` writes it, every number exact. With `kg`, the mass of the disc, forces act on it.
inline IdentifiedModel identified(const Machine& m, double kg = 0) {
  IdentifiedModel model;
  model.method = "weak";
  RotorModel r;
  r.k1 = m.k, r.k2 = m.cubic, r.c = m.c;
  if (kg > 0) r.gain = 1 / kg;
  r.eps = std::polar(m.e, m.e_phase);
  model.rotor = r;
  const auto add = [&](const char* name, double value) {
    if (value != 0) model.parameters.emplace_back(name, Estimate::from_sd(value, 0));
  };
  add("k3", m.quintic);
  add("k2_axis", m.cubic_axis);
  add("c2", m.quadratic);
  add("friction", m.dry);
  if (m.dry != 0) add("friction_speed", 1e-4);  // that of the machine
  add("gyroscopic", m.gyroscopic);
  add("c_rotating", m.c_rotating);
  add("k_cross", m.cross);
  add("k1_speed", m.k * m.k_with_speed / m.top_speed);
  add("c_speed", m.c * m.c_with_speed / m.top_speed);
  add("k1_drift", m.k * m.k_in_time / m.horizon);
  add("c_drift", m.c * m.c_in_time / m.horizon);
  return model;
}

}  // namespace whirl::testing
