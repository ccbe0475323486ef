#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& conj_stiffness() {
  static const TermEntry entry{
      .label = "anisotropic stiffness",
      .with =
          [](Growth g, int, bool) {
            g.active.conj_stiffness = true;
            return g;
          },
      .without = [](Growth g, int) -> std::optional<Growth> {
        g.active.conj_stiffness = false;
        g.start.k1_conj = 0;
        return g;
      },
      .columns = [](const ScorePoint& at) -> Candidates {
        if (at.active.conj_stiffness) return {};
        return {{0, {at.rows.apply(0, at.own.main.conjugate())}}};
      },
      .both_axes = true,
      .plain_threshold = true,
      .hinted = false,
      .decider = Decider::probes,
  };
  return entry;
}

}  // namespace whirl::identification::terms
