#pragma once
#include <vector>

#include "whirl/identify/identify_rotor.hpp"

namespace whirl::identification::detail {

/// The rotor with the parts that `like` has, found anew from recordings that are some of its own: nothing is sought.
RotorIdentification rotor_like(const std::vector<Recording>& recordings, const RotorIdentification& like,
                               const RotorIdentifyOptions& options);

}  // namespace whirl::identification::detail
