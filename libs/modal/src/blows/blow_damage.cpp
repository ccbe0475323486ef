#include "blow_damage.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "whirl/records/check.hpp"

namespace whirl::modal {
namespace {

bool spoils(records::FindingKind kind) {
  using enum records::FindingKind;
  return kind == frozen || kind == dropout || kind == gap;
}

std::string words(records::FindingKind kind) {
  return kind == records::FindingKind::dropout ? "reads 0" : "stands still";
}

}  // namespace

std::vector<std::vector<std::string>> blow_damage(const std::vector<Recording>& recordings,
                                                  const std::vector<Recording>& blows,
                                                  const std::vector<std::size_t>& owner,
                                                  const std::vector<std::string>& responses) {
  std::vector<std::vector<std::string>> result(blows.size());
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    Recording moving;
    moving.dt = recordings[r].dt;
    moving.t0 = recordings[r].t0;
    moving.source = recordings[r].source;
    for (const std::string& name : responses) {
      const Channel& c = recordings[r].at(name);
      moving.add(c.name, c.quantity, c.samples);
    }
    for (const records::Finding& f : records::check(moving).findings) {
      if (!spoils(f.kind)) continue;
      for (std::size_t b = 0; b < blows.size(); ++b) {
        const double end = blows[b].t0 + blows[b].dt * static_cast<double>(blows[b].size() - 1);
        if (owner[b] != r || f.end < blows[b].t0 || f.begin > end) continue;
        result[b].push_back(fmt::format("{} {} from {:.4g} to {:.4g} s while the structure moves ({} samples)",
                                        f.channel, words(f.kind), std::max(f.begin, blows[b].t0), std::min(f.end, end),
                                        f.samples));
      }
    }
  }
  return result;
}

}  // namespace whirl::modal
