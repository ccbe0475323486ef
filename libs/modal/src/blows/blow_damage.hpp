#pragma once
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::modal {

/// What happened to the responses of each blow between sensor and file: stretches that stand still or read zero while
/// the structure moves; one sentence each, none for a sound blow. The recordings are looked at whole, since a blow may
/// begin or end inside such a stretch. `owner`: recording of each blow; `responses`: names of the channels looked at.
std::vector<std::vector<std::string>> blow_damage(const std::vector<Recording>& recordings,
                                                  const std::vector<Recording>& blows,
                                                  const std::vector<std::size_t>& owner,
                                                  const std::vector<std::string>& responses);

}  // namespace whirl::modal
