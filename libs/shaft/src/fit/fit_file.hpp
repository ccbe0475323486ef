#pragma once
#include "whirl/io/settings.hpp"
#include "whirl/shaft/fit/setup.hpp"

namespace whirl::shaft {

/// [fit] and [[trial]] of a rotor file.
FitSetup read_fit_setup(const io::Settings& settings, const Rotor& rotor);

}  // namespace whirl::shaft
