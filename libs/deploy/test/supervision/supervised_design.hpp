#pragma once
#include <complex>

#include "whirl/core/control_types.hpp"
#include "whirl/testing/control/foreign_rig.hpp"

namespace whirl::deploy {

/// A supervised design for that machine, by its own numbers; the law's are those of the table.
inline ControllerDesign supervised_design(const testing::ForeignMachine& m, const char* law, const char* estimator) {
  ControllerDesign d;
  d.law = law;
  d.estimator = estimator;
  d.model.k1 = m.stiffness / m.mass;
  d.model.k2 = m.cubic / m.mass;
  d.model.c = m.damping / m.mass;
  d.model.gain = 1 / m.mass;
  d.model.eps = std::polar(m.unbalance, m.unbalance_angle);
  d.sample_time = testing::ForeignRig::kTick;
  d.delay = m.age + m.delay + m.lag;
  d.force_limit = m.force_limit;
  d.parameters = {{"sensor_delay", m.age}, {"supervise", 1}, {"watch_level", 60e-6}};
  return d;
}

}  // namespace whirl::deploy
