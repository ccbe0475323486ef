#pragma once
#include "whirl/core/summary.hpp"
#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

/// Takes over what its fit said against a rotor (Rotor::not_trusted).
void carry_distrust(const Rotor& rotor, Consequence consequence, Summary& summary);

}  // namespace whirl::shaft
