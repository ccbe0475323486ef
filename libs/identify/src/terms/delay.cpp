#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& delay() {
  // The displacement channels are older than the angle.
  static const TermEntry entry{
      .label = "delay",
      .with =
          [](Growth g, int, bool) {
            g.active.clock.delay = true;
            return g;
          },
      .without = [](Growth g, int) -> std::optional<Growth> {
        g.active.clock.delay = false;
        g.delay = 0;
        return g;
      },
      .columns = [](const ScorePoint& at) -> Candidates {
        if (!at.options.delay || at.active.clock.delay) return {};
        return {{0, {at.force(at.late())}, true}};
      },
      .plain_threshold = true,
      .hinted = false,
  };
  return entry;
}

}  // namespace whirl::identification::terms
