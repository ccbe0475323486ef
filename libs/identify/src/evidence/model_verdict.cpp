#include "evidence/model_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "evidence/verdict.hpp"

namespace whirl::identification::detail {

void compare_with_rest(const IdentifiedModel& rest, IdentifiedModel& model) {
  constexpr double k95 = 1.959963984540054;
  for (const auto& [name, part] : rest.parameters) {
    if (name != "k1" && name != "k2" && name != "c" && name != "e") continue;
    for (auto& [own, e] : model.parameters) {
      if (own != name) continue;
      const double shift = std::abs(part.value - e.value), sd = std::hypot(part.sd, e.sd);
      if (!(shift > 4 * sd) || !(shift > 1e-3 * std::abs(e.value))) continue;
      model.summary.add({FindingCode::parameter_differs,
                         Consequence::no_trust,
                         {{"all", e.value}, {"rest", part.value}, {"deviations", shift / sd}},
                         name});
      e.low = std::min(e.low, part.low);
      e.high = std::max(e.high, part.high);
      e.sd = std::max({e.sd, (e.value - e.low) / k95, (e.high - e.value) / k95});
    }
  }
}

void judge_evidence(Identification& id) {
  judge_held_out(id.evidence.held_out, id.model.summary);
  judge_remaining(id.model.summary);
  id.summary = id.model.summary;
}

}  // namespace whirl::identification::detail
