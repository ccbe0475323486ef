#include "evidence/model_verdict.hpp"

#include <fmt/format.h>

#include <cmath>

namespace whirl::identification::detail {

void judge_evidence(Identification& id) {
  const HeldOut& h = id.evidence.held_out;
  Summary& summary = id.model.summary;
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
