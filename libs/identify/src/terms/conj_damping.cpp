#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& conj_damping() {
  static const TermEntry entry{
      .label = "anisotropic damping",
      .with =
          [](Growth g, int, bool) {
            g.active.conj_damping = true;
            return g;
          },
      .without = [](Growth g, int) -> std::optional<Growth> {
        g.active.conj_damping = false;
        g.start.c_conj = 0;
        return g;
      },
      .columns = [](const ScorePoint& at) -> Candidates {
        if (at.active.conj_damping) return {};
        return {{0, {at.rows.apply(1, at.own.main.conjugate())}}};
      },
      .both_axes = true,
      .plain_threshold = true,
      .hinted = false,
      .decider = Decider::probes,
  };
  return entry;
}

}  // namespace whirl::identification::terms
