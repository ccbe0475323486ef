#pragma once
#include <string>

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

}  // namespace whirl::testing
