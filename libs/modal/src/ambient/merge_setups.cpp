#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/modal/oma.hpp"
#include "whirl/modal/poles.hpp"

namespace whirl::modal {

using Eigen::Index;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

OperationalModes merge_setups(const std::vector<OperationalModes>& setups) {
  if (setups.empty()) throw Error("no set-ups to merge");
  OperationalModes merged = setups.front();
  for (std::size_t s = 1; s < setups.size(); ++s) {
    const OperationalModes& next = setups[s];
    std::vector<std::pair<Index, Index>> shared;  // channel of merged, of next
    std::vector<Index> added;
    for (std::size_t c = 0; c < next.channels.size(); ++c) {
      const auto found = std::find(merged.channels.begin(), merged.channels.end(), next.channels[c]);
      if (found != merged.channels.end()) {
        shared.emplace_back(found - merged.channels.begin(), static_cast<Index>(c));
      } else {
        added.push_back(static_cast<Index>(c));
      }
    }
    if (shared.empty()) throw Error(fmt::format("set-up {} shares no channel name with those before it", s + 1));
    std::vector<OperationalMode> kept;
    for (const OperationalMode& mode : merged.modes) {
      const OperationalMode* best = nullptr;
      double score = -INFINITY;
      VectorXcd a(static_cast<Index>(shared.size())), b = a, chosen = a;
      for (const OperationalMode& other : next.modes) {
        const double df = std::abs(other.frequency.value / mode.frequency.value - 1);
        if (df > 0.05) continue;
        for (std::size_t i = 0; i < shared.size(); ++i) {
          a[static_cast<Index>(i)] = mode.shape[shared[i].first];
          b[static_cast<Index>(i)] = other.shape[shared[i].second];
        }
        const double value = (shared.size() > 1 ? mac(a, b) : 0) - 20 * df;
        if (value <= score) continue;
        score = value;
        best = &other;
        chosen = b;
      }
      if (best == nullptr) {
        merged.summary.warn(
            fmt::format("mode at {:.5g} Hz is not seen in set-up {}: left out", mode.frequency.value, s + 1));
        continue;
      }
      const Complex factor = chosen.dot(a) / chosen.squaredNorm();
      OperationalMode joined = mode;
      joined.shape.conservativeResize(mode.shape.size() + static_cast<Index>(added.size()));
      for (std::size_t i = 0; i < added.size(); ++i)
        joined.shape[mode.shape.size() + static_cast<Index>(i)] = factor * best->shape[added[i]];
      const auto mean = [](const Estimate& x, const Estimate& z) {
        const double wx = 1 / (x.sd * x.sd), wz = 1 / (z.sd * z.sd);
        return Estimate::from_sd((wx * x.value + wz * z.value) / (wx + wz), 1 / std::sqrt(wx + wz));
      };
      joined.frequency = mean(mode.frequency, best->frequency);
      joined.damping = mean(mode.damping, best->damping);
      kept.push_back(std::move(joined));
    }
    merged.modes = std::move(kept);
    for (const Index c : added) merged.channels.push_back(next.channels[static_cast<std::size_t>(c)]);
    for (const Tone& tone : next.tones) {
      if (std::none_of(merged.tones.begin(), merged.tones.end(), [&](const Tone& t) {
            return std::abs(t.frequency - tone.frequency) < 0.002 * tone.frequency;
          })) {
        merged.tones.push_back(tone);
      }
    }
    for (const auto& warning : next.summary.warnings) merged.summary.warn(fmt::format("set-up {}: {}", s + 1, warning));
  }
  for (OperationalMode& mode : merged.modes) {
    Index largest = 0;
    mode.shape.cwiseAbs().maxCoeff(&largest);
    mode.shape /= mode.shape[largest];
  }
  if (merged.modes.empty()) merged.summary.fail("no mode is common to the set-ups");
  merged.summary.trust = fmt::format("{} modes common to {} set-ups", merged.modes.size(), setups.size());
  return merged;
}

}  // namespace whirl::modal
