#pragma once
#include <algorithm>
#include <numbers>
#include <string>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/magnitude.hpp"

namespace whirl::identification::detail {

/// Intervals of the parameters that are sizes of vectors ("e" beside "e_phase"): never below zero, and near it by the
/// law of a size (core/magnitude.hpp). Where zero is within, any phase is.
inline void keep_magnitudes(IdentifiedModel& model) {
  for (auto& [name, size] : model.parameters) {
    const std::string of_phase = name + "_phase";
    const auto phase = std::ranges::find(model.parameters, of_phase, &std::pair<std::string, Estimate>::first);
    if (phase == model.parameters.end()) continue;
    const Estimate near_zero = magnitude_estimate(size.value, size.sd);
    size.low = size.low < 0 ? near_zero.low : std::min(size.low, near_zero.low);
    size.high = std::max(size.high, near_zero.high);
    if (size.low > 0) continue;
    phase->second.low = phase->second.value - std::numbers::pi;
    phase->second.high = phase->second.value + std::numbers::pi;
  }
}

}  // namespace whirl::identification::detail
