#include "evidence/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rules/rules.hpp"

namespace whirl::identification::detail {

bool judge_unexplained(double unexplained, const std::string& run, const std::string& cause, Summary& summary) {
  if (unexplained < rules::kUnexplained) return true;
  summary.add({FindingCode::motion_unexplained, Consequence::unusable, {{"share", unexplained}}, run}, ": " + cause);
  return false;
}

bool judge_chi_square(double chi_square, const std::string& consequence, Summary& summary, double share) {
  if (!(chi_square > rules::kModelError)) return false;
  Finding error{FindingCode::model_error, Consequence::warning, {{"chi_square", chi_square}}};
  if (std::isfinite(share)) error.amounts.push_back({"share", share});
  summary.add(std::move(error), consequence);
  return true;
}

void judge_held_out(const HeldOut& held, Summary& summary) {
  const auto square = [](double value) { return value * value; };
  if (summary.status == Status::unusable) return;
  if (!held.reason.empty())
    summary.add({FindingCode::held_out_not_tried, Consequence::warning, {}, held.what}, ": " + held.reason);
  double worst = 0;
  bool moves = false, tests = false;  // a state moves; what moves it is more than what the intervals leave open
  const StateScore* missed = nullptr;
  for (const StateScore& s : held.horizon > 0 ? held.near : held.scores) {
    if (!std::isfinite(s.rmse)) {
      summary.add({FindingCode::held_out_diverges, Consequence::unusable, {}, held.what});
      return;
    }
    const double beyond = std::sqrt(std::max(0.0, s.rmse * s.rmse - s.noise * s.noise));
    const double spread = s.nrmse > 0 ? s.rmse / s.nrmse : INFINITY;
    const double motion = std::sqrt(std::max(spread * spread - s.noise * s.noise, 1e-2 * spread * spread));
    const bool still = square(spread) <= rules::kHeldOutScatter * square(s.noise);
    moves = moves || !still;
    tests = tests || (!still && !(s.band > rules::kRunOpen * motion));
    if (s.rmse <= s.band) continue;  // what the intervals of the rest account for contradicts nothing
    if (!(s.noise > 0 && square(s.rmse) <= rules::kHeldOutScatter * square(s.noise)))
      worst = std::max(worst, beyond / motion);
    if (missed == nullptr && s.noise > 0 && square(s.rmse) > rules::kHeldOutMore * square(s.noise) &&
        beyond > rules::kHeldOutSeen * motion)
      missed = &s;
  }
  if (worst > rules::kLost) {
    summary.add({FindingCode::held_out_not_predicted, Consequence::unusable, {{"share", worst}}, held.what});
  } else if (missed != nullptr) {
    summary.add({FindingCode::held_out_missed,
                 Consequence::no_trust,
                 {{"rmse", missed->rmse}, {"noise", missed->noise}},
                 missed->state + " of " + held.what});
  } else if (!held.scores.empty() && !tests) {
    set_trust(fmt::format("{} Nothing tests it: {}.", summary.trust,
                          moves ? fmt::format("the rest leaves open how {} moves", held.what)
                                : held.what + " holds hardly more than noise"),
              summary);
  }
}

void judge_remaining(Summary& summary) {
  if (summary.status == Status::unusable || !(summary.chi_square > rules::kNoTrust)) return;
  // A probe that resolves a thousandth of the motion sees what no use of the model would notice.
  const Finding* said = summary.find(FindingCode::model_error);
  if (said != nullptr && said->amount("share") < rules::kSlight && summary.chi_square < rules::kAnotherModel) return;
  Finding large{FindingCode::model_error, Consequence::no_trust, {{"chi_square", summary.chi_square}}};
  if (summary.status == Status::ok) {
    summary.add(std::move(large));
    return;
  }
  set_trust(trust_text(large), summary);  // in words it stands among the warnings already
  summary.findings.push_back(std::move(large));
}

void set_trust(const std::string& sentence, Summary& summary) {
  summary.trust = summary.status == Status::unusable ? "Do not use this model." : sentence;
}

}  // namespace whirl::identification::detail
