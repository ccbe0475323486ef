#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/modal/frf.hpp"

namespace whirl::modal {

FrequencyResponse join_references(const std::vector<FrequencyResponse>& parts) {
  if (parts.empty()) throw Error("no frequency responses to join");
  Eigen::Index lines = parts.front().frequency.size();
  for (const auto& part : parts) lines = std::min(lines, part.frequency.size());
  FrequencyResponse joined = parts.front();
  joined.frequency.conservativeResize(lines);
  joined.channels.clear();
  joined.summary.warnings.clear();
  for (const auto& part : parts) {
    const double step = joined.frequency.size() > 1 ? joined.frequency[1] - joined.frequency[0] : 1;
    if ((part.frequency.head(lines) - joined.frequency).cwiseAbs().maxCoeff() > 1e-6 * step) {
      throw Error("frequency responses to join: must share one frequency axis");
    }
    if (part.kind != joined.kind ||
        std::abs(part.window_decay - joined.window_decay) > 1e-6 * (1 + joined.window_decay)) {
      throw Error("frequency responses to join: must be of one kind and one exponential window");
    }
    joined.averages = std::min(joined.averages, part.averages);
    for (FrfChannel channel : part.channels) {
      channel.value.conservativeResize(lines);
      if (channel.coherence.size() > 0) channel.coherence.conservativeResize(lines);
      if (channel.variance.size() > 0) channel.variance.conservativeResize(lines);
      for (const FrfChannel& other : joined.channels) {
        if (other.response == channel.response && other.reference == channel.reference) {
          throw Error(fmt::format(
              "frequency responses to join: {} / {} stands in two of them: the points hit must have different names",
              channel.response, channel.reference));
        }
      }
      joined.channels.push_back(std::move(channel));
    }
    for (const auto& warning : part.summary.warnings) joined.summary.warn(warning);
  }
  return joined;
}

}  // namespace whirl::modal
