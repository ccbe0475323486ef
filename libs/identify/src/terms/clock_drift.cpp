#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& clock_drift() {
  // Displacement and angle from two recorders: the displacement is older by a share of the time of the record.
  static const TermEntry entry{
      .label = "clocks that drift apart",
      .with =
          [](Growth g, int, bool) {
            g.active.clock.drift = true;
            return g;
          },
      .without = [](Growth g, int) -> std::optional<Growth> {
        g.active.clock.drift = false;
        g.active.clock.start_drift = 0;
        return g;
      },
      .columns = [](const ScorePoint& at) -> Candidates {
        if (!at.options.delay || at.active.clock.drift || at.active.clock.profile_degree > 0) return {};
        Eigen::VectorXcd late = at.late();
        for (Eigen::Index i = 0; i < late.size(); ++i) late[i] *= at.record.dt * static_cast<double>(i);
        return {{0, {at.force(late)}, true}};
      },
      .rare = true,
      .decider = Decider::one_clock,
  };
  return entry;
}

}  // namespace whirl::identification::terms
