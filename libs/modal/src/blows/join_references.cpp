#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/modal/frf.hpp"

namespace whirl::modal {

FrequencyResponse join_references(const std::vector<FrequencyResponse>& parts) {
  if (parts.empty()) throw Error("no frequency responses to join");
  // The lines that all have: the bands of shakers begin where each has power.
  double low = 0, high = INFINITY;
  for (const auto& part : parts) {
    if (part.frequency.size() < 2) throw Error("frequency responses to join: must have two lines or more each");
    low = std::max(low, part.frequency[0]);
    high = std::min(high, part.frequency[part.frequency.size() - 1]);
  }
  FrequencyResponse joined = parts.front();
  const double step = joined.frequency[1] - joined.frequency[0];
  const auto lines = static_cast<Eigen::Index>(std::lround((high - low) / step)) + 1;
  if (lines < 2) throw Error("frequency responses to join: their bands have nothing in common");
  const auto first_of = [&](const FrequencyResponse& part) {
    return static_cast<Eigen::Index>(std::lround((low - part.frequency[0]) / step));
  };
  joined.frequency = Eigen::VectorXd(parts.front().frequency.segment(first_of(parts.front()), lines));
  joined.channels.clear();
  joined.summary.warnings.clear();
  for (const auto& part : parts) {
    const Eigen::Index first = first_of(part);
    if (first + lines > part.frequency.size() ||
        (part.frequency.segment(first, lines) - joined.frequency).cwiseAbs().maxCoeff() > 1e-6 * step) {
      throw Error(
          "frequency responses to join: must share one frequency axis (whirl frf: --duration-s sets that of "
          "impacts, --resolution-hz that of shakers)");
    }
    if (part.kind != joined.kind ||
        std::abs(part.window_decay - joined.window_decay) > 1e-6 * (1 + joined.window_decay)) {
      throw Error("frequency responses to join: must be of one kind and one exponential window");
    }
    joined.averages = std::min(joined.averages, part.averages);
    joined.leakage_free = joined.leakage_free && part.leakage_free;
    for (FrfChannel channel : part.channels) {
      channel.value = Eigen::VectorXcd(channel.value.segment(first, lines));
      if (channel.coherence.size() > 0) channel.coherence = Eigen::VectorXd(channel.coherence.segment(first, lines));
      if (channel.variance.size() > 0) channel.variance = Eigen::VectorXd(channel.variance.segment(first, lines));
      for (const FrfChannel& other : joined.channels) {
        if (other.response == channel.response && other.reference == channel.reference) {
          throw Error(fmt::format(
              "frequency responses to join: {} / {} is in two of them: the points hit must have different names",
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
