#pragma once
#include <vector>

#include "whirl/core/rotor_model.hpp"
#include "whirl/deploy/code.hpp"

namespace whirl::deploy {

/// The coefficients of the rotor's equations as parameters, without the gain of the actuators.
std::vector<CodeParameter> rotor_parameters(const RotorModel& model);

}  // namespace whirl::deploy
