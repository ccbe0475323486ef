#pragma once
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "whirl/core/control_types.hpp"

namespace whirl::testing {

/// A controller of a 1.5 kg rotor with its critical speed at 12 Hz, two samples of delay.
inline ControllerDesign design_of(const std::string& law, const std::string& estimator) {
  ControllerDesign d;
  d.law = law;
  d.estimator = estimator;
  d.model.k1 = 5700;
  d.model.k2 = 1e7;
  d.model.c = 1;
  d.model.eps = {280e-6, 40e-6};
  d.model.gain = 1 / 1.5;
  d.sample_time = 1e-3;
  d.delay = 2.05e-3;
  d.force_limit = 40;
  d.parameters["sensor_delay"] = 0.25e-3;
  return d;
}

/// 20 s of readings of a run-down through the critical speed: an orbit of the given radius in m and a little of a
/// second frequency; the angle wrapped, so that single precision holds it.
inline std::vector<Measurement> run_down_readings(double radius = 1e-4) {
  std::vector<Measurement> readings(20000);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    Measurement& m = readings[k];
    m.t = t;
    m.omega = 188 - 9 * t;
    m.omega_dot = -9;
    m.beta = std::remainder(188 * t - 4.5 * t * t, 2 * std::numbers::pi);
    m.x = radius * (std::cos(m.beta) + 0.01 * std::sin(377 * t));
    m.y = radius * std::sin(m.beta);
  }
  return readings;
}

}  // namespace whirl::testing
