#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& cross_damping() {
  // Seals and pumps: the damping of the fluid that swirls.
  static const TermEntry entry{
      .label = "cross-coupled damping",
      .parameters = {{"c_cross", "1/s"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // i v
            TermForce f;
            f.x = -p.vy, f.y = p.vx, f.x_vy = -1, f.y_vx = 1;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one(a.other_rate, a.turn); },
      .rare = true,
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
