#include "evidence/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace whirl::identification::detail {

bool judge_unexplained(double unexplained, const std::string& run, const std::string& cause, Summary& summary) {
  constexpr double kUnusable = 0.15;
  if (unexplained < kUnusable) return true;
  summary.fail(
      fmt::format("{} {:.0f} % of the motion unexplained beyond the noise: {}", run, 100 * unexplained, cause));
  return false;
}

bool judge_chi_square(double chi_square, const std::string& consequence, Summary& summary) {
  constexpr double kModelError = 1.3;
  if (!(chi_square > kModelError)) return false;
  summary.warn(fmt::format("model error: chi-square {:.2f} (1 when the model fits){}", chi_square, consequence));
  return true;
}

void judge_held_out(const HeldOut& held, Summary& summary) {
  constexpr double kUnusable = 0.5, kSeen = 0.02;
  // What is left may exceed the noise by this only because both are estimates of few samples.
  constexpr double kScatter = 1.3;
  if (summary.status == Status::unusable) return;
  if (!held.reason.empty()) summary.warn(fmt::format("no prediction of {}: {}", held.what, held.reason));
  double worst = 0;
  bool moves = false;
  const StateScore* missed = nullptr;
  for (const StateScore& s : held.horizon > 0 ? held.near : held.scores) {
    if (!std::isfinite(s.rmse)) {
      summary.fail(fmt::format("the free run of a model of the rest diverges on {}", held.what));
      set_trust("", summary);
      return;
    }
    const double beyond = std::sqrt(std::max(0.0, s.rmse * s.rmse - s.noise * s.noise));
    const double spread = s.nrmse > 0 ? s.rmse / s.nrmse : INFINITY;
    const double motion = std::sqrt(std::max(spread * spread - s.noise * s.noise, 1e-2 * spread * spread));
    moves = moves || !(spread <= kScatter * s.noise);
    if (!(s.noise > 0 && s.rmse <= kScatter * s.noise)) worst = std::max(worst, beyond / motion);
    if (missed == nullptr && s.noise > 0 && s.rmse > 2 * s.noise && beyond > kSeen * motion) missed = &s;
  }
  if (worst > kUnusable) {
    summary.fail(fmt::format("a model of the rest does not predict {}: error {:.0f} % of the motion beyond the noise",
                             held.what, 100 * worst));
    set_trust("", summary);
  } else if (missed != nullptr) {
    summary.warn(
        fmt::format("a model of the rest predicts {} of {} with an error of {:.3g} rms, {:.1f} times the noise",
                    missed->state, held.what, missed->rmse, missed->rmse / missed->noise));
    set_trust("Do not trust this model beyond these records: it does not predict a part held out to the noise.",
              summary);
  } else if (!held.scores.empty() && !moves) {
    set_trust(fmt::format("{} Nothing tests it: {} holds hardly more than noise.", summary.trust, held.what), summary);
  }
}

void judge_remaining(Summary& summary) {
  constexpr double kNoTrust = 2;
  if (summary.status == Status::unusable || !(summary.chi_square > kNoTrust)) return;
  if (summary.status == Status::ok) judge_chi_square(summary.chi_square, "", summary);
  set_trust(fmt::format("Do not trust this model beyond these records: chi-square is {:.3g} after the search for "
                        "terms, so that something it does not have drives the motion.",
                        summary.chi_square),
            summary);
}

void set_trust(const std::string& sentence, Summary& summary) {
  summary.trust = summary.status == Status::unusable ? "Do not use this model." : sentence;
}

}  // namespace whirl::identification::detail
