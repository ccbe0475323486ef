#include "evidence/magnitudes.hpp"

#include <algorithm>
#include <numbers>
#include <string>

#include "whirl/core/magnitude.hpp"

namespace whirl::identification::detail {

void keep_magnitudes(IdentifiedModel& model) {
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
