#include "evidence/model_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "evidence/verdict.hpp"
#include "rules/rules.hpp"
#include "whirl/core/angles.hpp"

namespace whirl::identification::detail {

void compare_with_rest(const IdentifiedModel& rest, IdentifiedModel& model) {
  for (const auto& [name, part] : rest.parameters) {
    if (name != "k1" && name != "k2" && name != "c" && name != "e") continue;
    for (auto& [own, e] : model.parameters) {
      if (own != name) continue;
      const double shift = std::abs(part.value - e.value), sd = std::hypot(part.sd, e.sd);
      if (!(shift > rules::kRestDiffers * sd) || !(shift > rules::kRestMatters * std::abs(e.value))) continue;
      model.summary.add({FindingCode::parameter_differs,
                         Consequence::no_trust,
                         {{"all", e.value}, {"rest", part.value}, {"deviations", shift / sd}},
                         name});
      e.low = std::min(e.low, part.low);
      e.high = std::max(e.high, part.high);
      e.sd = std::max({e.sd, (e.value - e.low) / rules::k95, (e.high - e.value) / rules::k95});
    }
  }
}

bool same_parts(const IdentifiedModel& a, const IdentifiedModel& b) {
  constexpr double kSame = 0.1;
  const auto first = [](const IdentifiedModel& m) { return m.rotor ? m.rotor->natural_frequency() : 0; };
  const bool modes = a.rotor && b.rotor && !a.rotor->modes.empty();
  if (modes && std::abs(first(a) - first(b)) > kSame * first(b)) return false;
  return std::ranges::equal(a.parameters, b.parameters, {}, &std::pair<std::string, Estimate>::first,
                            &std::pair<std::string, Estimate>::first);
}

std::vector<Finding> not_shown_by_rest(const IdentifiedModel& model, const DataRange& all, const DataRange& rest,
                                       const std::function<double(double)>& rate, const std::string& held) {
  // Damping is read between the half-power points of a resonance: a flank below them does not determine it.
  constexpr double kHalfPower = 0.70710678;
  constexpr double kPassed = 2;  // half-power widths: a sweep peaks later than the steady response
  // Without damping the motion is largest sqrt(pi) 1.22 sqrt(rate) beyond the resonance (Fresnel's integrals; Lewis
  // 1932): a rest that ends before has hardly seen it.
  constexpr double kSwept = 2.16;
  std::vector<Finding> out;
  if (!model.rotor || !(all.amplitude > 0)) return out;
  const bool comparable = std::isfinite(rest.amplitude);
  const double share = comparable ? rest.amplitude / all.amplitude : std::numeric_limits<double>::quiet_NaN();
  // `band` on both sides, as far as there are records.
  const auto lacks = [&](double omega, double band) {
    return all.low <= omega && omega <= all.high &&
           (rest.low > std::max(all.low, omega - band) || rest.high < std::min(all.high, omega + band));
  };
  const auto add = [&](double omega) {
    out.push_back({FindingCode::held_out_cannot_check,
                   Consequence::warning,
                   {{"frequency", omega * kHzPerRadPerSec, "Hz"},
                    {"low", rest.low * kHzPerRadPerSec, "Hz"},
                    {"high", rest.high * kHzPerRadPerSec, "Hz"},
                    {"share", share}},
                   held});
  };
  const auto passage = [&](double omega, double zeta) {
    return std::max(kPassed * zeta * omega, kSwept * std::sqrt(rate(omega)));
  };
  const double critical = model.rotor->natural_frequency();
  // A hardening spring moves the resonance away from the natural frequency: the motion tells whether it is there.
  // The largest motion may be that of a further mode, which a run-down passes first.
  const bool further = !model.rotor->modes.empty();
  const bool motion_lacks = comparable && share < kHalfPower;
  const double around = further ? passage(critical, 0.5 * model.rotor->c / critical) : 0;
  if (motion_lacks || ((further || !comparable) && lacks(critical, around))) add(critical);
  for (const ForcedMode& mode : model.rotor->modes)
    if (lacks(mode.omega, passage(mode.omega, mode.zeta))) add(mode.omega);
  return out;
}

void judge_evidence(Identification& id) {
  Summary& summary = id.model.summary;
  if (id.evidence.not_shown.empty()) {
    judge_held_out(id.evidence.held_out, summary);
  } else if (summary.status != Status::unusable) {
    // The rest cannot predict what it does not show, nor contradict it.
    for (const Finding& f : id.evidence.not_shown) summary.add(f);
    const bool change = std::isfinite(id.evidence.not_shown.front().amount("instant"));
    set_trust(fmt::format("{} Nothing tests it {} that only {} {}.", summary.trust,
                          change ? "across the change" : "at the resonance", id.evidence.held_out.what,
                          change ? "shows" : "passes"),
              summary);
  }
  judge_remaining(id.model.summary);
  id.summary = id.model.summary;
}

}  // namespace whirl::identification::detail
