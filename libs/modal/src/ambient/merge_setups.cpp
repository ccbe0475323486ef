#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pooled_estimate.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/modal/oma.hpp"
#include "whirl/modal/order_modes.hpp"
#include "whirl/modal/poles.hpp"

namespace whirl::modal {

using Eigen::Index;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace {

using Seen = std::vector<const OperationalMode*>;  // one mode as each set-up shows it

// Frequencies and damping as means over the set-ups. Warming moves all frequencies by about one factor, so that all
// modes together show what a single one does not.
void pool_setups(const std::vector<Seen>& seen, OperationalModes& merged) {
  std::vector<std::vector<Estimate>> frequency, damping;
  double squares = 0, freedom = 0, relative2 = 0;
  for (const Seen& one : seen) {
    frequency.emplace_back();
    damping.emplace_back();
    for (const OperationalMode* mode : one) {
      frequency.back().push_back(mode->frequency);
      damping.back().push_back(mode->damping);
    }
    const PooledEstimate pooled = pool(frequency.back());
    squares += pooled.squares;
    freedom += static_cast<double>(one.size()) - 1;
    relative2 += std::pow(pooled.between / pooled.mean.value, 2) / static_cast<double>(seen.size());
  }
  const bool together = !seen.empty() && chance_of(squares, freedom) < 0.01;
  for (std::size_t m = 0; m < merged.modes.size(); ++m) {
    const double between = together ? std::sqrt(relative2) * merged.modes[m].frequency.value : 0;
    const PooledEstimate pooled = pool(frequency[m], 20, between);
    merged.modes[m].frequency = pooled.mean;
    merged.modes[m].damping = pool(damping[m]).mean;
    if (!together && pooled.probability * static_cast<double>(merged.modes.size()) < 0.005)
      merged.summary.warn(fmt::format(
          "mode at {:.5g} Hz: its frequency differs between the set-ups by {:.2g} % (sd), beyond its errors; "
          "listed is the mean, with that in its interval",
          pooled.mean.value, 100 * pooled.between / pooled.mean.value));
  }
  if (together)
    merged.summary.warn(fmt::format(
        "frequencies differ between the set-ups by {:.2g} % (sd), beyond their errors: the structure changed "
        "from one to the next; listed are the means, with that in their intervals",
        100 * std::sqrt(relative2)));
}

}  // namespace

OperationalModes merge_setups(const std::vector<OperationalModes>& setups) {
  if (setups.empty()) throw Error("no set-ups to merge");
  OperationalModes merged = setups.front();
  std::vector<Seen> seen;
  for (const OperationalMode& mode : setups.front().modes) seen.push_back({&mode});
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
    std::vector<Seen> kept_seen;
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
      kept.push_back(std::move(joined));
      kept_seen.push_back(seen[static_cast<std::size_t>(&mode - merged.modes.data())]);
      kept_seen.back().push_back(best);
    }
    merged.modes = std::move(kept);
    seen = std::move(kept_seen);
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
  if (setups.size() > 1) pool_setups(seen, merged);
  for (OperationalMode& mode : merged.modes) {
    Index largest = 0;
    mode.shape.cwiseAbs().maxCoeff(&largest);
    mode.shape /= mode.shape[largest];
  }
  if (merged.modes.empty()) merged.summary.fail("no mode is common to the set-ups");
  merged.summary.trust =
      fmt::format("{} common to {}", counted(merged.modes.size(), "mode"), counted(setups.size(), "set-up"));
  return merged;
}

OperationalModes identify_setups(const std::vector<Recording>& setups, const SetupsOptions& options) {
  if (setups.empty()) throw Error("oma: no record");
  const bool by_orders = options.method == "orders";
  if (!by_orders && options.method != "ssi-data" && options.method != "ssi-cov")
    throw Error::in_field("method", options.method, "'ssi-data', 'ssi-cov' or 'orders'");
  if (by_orders && options.joint)
    throw Error::in_field("method", options.method, "'ssi-data' or 'ssi-cov' for one model of several set-ups");
  OmaOptions oma = options.oma;
  oma.method = options.method == "ssi-cov" ? SubspaceMethod::covariance : SubspaceMethod::data;
  oma.orders = options.orders.value_or(0);
  if (options.joint) return identify_joint(setups, oma);
  std::vector<OperationalModes> found;
  for (const Recording& record : setups)
    found.push_back(by_orders ? identify_orders(record, {options.orders.value_or(1), oma.band_low, oma.band_high})
                              : identify_operational(record, oma));
  return found.size() == 1 ? found.front() : merge_setups(found);
}

}  // namespace whirl::modal
