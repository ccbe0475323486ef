#include "evidence/model_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace whirl::identification::detail {

void compare_with_rest(const IdentifiedModel& rest, IdentifiedModel& model) {
  constexpr double k95 = 1.959963984540054;
  for (const auto& [name, part] : rest.parameters) {
    if (name != "k1" && name != "k2" && name != "c" && name != "e") continue;
    for (auto& [own, e] : model.parameters) {
      if (own != name) continue;
      const double shift = std::abs(part.value - e.value), sd = std::hypot(part.sd, e.sd);
      if (!(shift > 4 * sd) || !(shift > 1e-3 * std::abs(e.value))) continue;
      model.summary.warn(
          fmt::format("{} is {:.5g} by all records and {:.5g} without the part held out, {:.1f} standard deviations "
                      "apart: they do not follow one model",
                      name, e.value, part.value, shift / sd));
      if (model.summary.status != Status::unusable)
        model.summary.trust = "Do not trust this model beyond these records: parts of them give different parameters.";
      e.low = std::min(e.low, part.low);
      e.high = std::max(e.high, part.high);
      e.sd = std::max({e.sd, (e.value - e.low) / k95, (e.high - e.value) / k95});
    }
  }
}

void judge_evidence(Identification& id) {
  const HeldOut& h = id.evidence.held_out;
  Summary& summary = id.model.summary;
  // A model of the rest that leaves twice the noise on the part held out does not follow it.
  if (id.model.rotor && summary.status != Status::unusable) {
    for (const StateScore& s : h.scores) {
      if (!(s.noise > 0) || !(s.rmse > 2 * s.noise) || !(s.nrmse > 0.02)) continue;
      summary.warn(
          fmt::format("a model of the rest predicts {} of {} with an error of {:.3g} mm rms, {:.1f} times the "
                      "noise",
                      s.state, h.what, 1e3 * s.rmse, s.rmse / s.noise));
      summary.trust = "Do not trust this model beyond these records: it does not predict a part held out to the noise.";
      break;
    }
  }
  const double worst = worst_nrmse(h.horizon > 0 ? h.near : h.scores);
  if (worst > 0.5) {
    summary.warn(
        std::isfinite(worst)
            ? fmt::format("a model of the rest does not predict {}: error {:.0f} % of the motion", h.what, 100 * worst)
            : fmt::format("the free run of a model of the rest diverges on {}", h.what));
  }
  id.summary = summary;
}

}  // namespace whirl::identification::detail
