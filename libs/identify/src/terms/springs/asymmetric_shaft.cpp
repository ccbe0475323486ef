#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& asymmetric_shaft() {
  // Keyways, poles, cracks that stay open: the stiffness of the shaft differs between two directions that turn with it.
  // Where the shaft sags, its weight acts through that as a force of constant size at twice the speed.
  static const TermEntry entry{
      .label = "stiffness turning with the shaft",
      .parameters = {{"k1_turning_re", "1/s^2"},
                     {"k1_turning_im", "1/s^2"},
                     {"sag_turning_re", "m/s^2"},
                     {"sag_turning_im", "m/s^2"}},
      .force =
          [](const TermPoint& p, double, std::size_t part) {  // -e^{2 i b} conj z, times i, e^{2 i b}, times i
            const double c = p.turn_twice().real(), s = p.turn_twice().imag();
            if (part > 1) return TermForce{.x = part == 2 ? c : -s, .y = part == 2 ? s : c};
            const double xx = part == 0 ? -c : s, xy = part == 0 ? -s : -c;
            TermForce f;
            f.x_x = xx, f.x_y = f.y_x = xy, f.y_y = -xx;
            f.x = xx * p.x + xy * p.y, f.y = xy * p.x - xx * p.y;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm& t) -> std::vector<TermText> {
        if (t.part > 1) return one((t.part == 2) == a.x ? "cos(2*X5)" : "sin(2*X5)", t.part == 3 && a.x ? -1 : 1);
        const char *own = t.part == 0 ? "cos(2*X5)*" : "sin(2*X5)*", *other = t.part == 0 ? "sin(2*X5)*" : "cos(2*X5)*";
        return {{own + a.own, (t.part == 0) == a.x ? -1.0 : 1.0}, {other + a.other, -1}};
      },
      .twice_a_turn = true,
      .rare = true,
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
