#pragma once
#include <string>
#include <vector>

#include "blow.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::modal {

/// What happened to the responses of each blow between sensor and file: stretches that stand still or read zero while
/// the structure moves; one sentence each, none for a sound blow. The recordings are looked at whole, since a blow may
/// begin or end inside such a stretch. `owner`: recording of each blow; `responses`: names of the channels looked at.
///
/// Single samples of a response that look like spikes (far off the cubic through their neighbours, away from the pulse,
/// where the samples about them are not) are reported: `spikes` gets a sentence for each channel of each blow
/// concerned. With `repair` they are replaced in `blows` by that cubic; otherwise no sample is changed.
std::vector<std::vector<std::string>> blow_damage(const std::vector<Recording>& recordings,
                                                  std::vector<Recording>& blows, const std::vector<Pulse>& pulses,
                                                  const std::vector<std::size_t>& owner,
                                                  const std::vector<std::string>& responses, bool repair,
                                                  std::vector<std::string>& spikes);

}  // namespace whirl::modal
