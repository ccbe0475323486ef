#pragma once
#include "whirl/io/settings.hpp"
#include "whirl/shaft/centrifuge/setup.hpp"
#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

/// [centrifuge] and [[accelerometer]] of a rotor file.
CentrifugeSetup read_centrifuge(const io::Settings& settings, const Rotor& rotor);

}  // namespace whirl::shaft
