#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& squeeze_film() {
  // Damping that grows with the orbit; for short films the first term of (1 - |z|^2 / gap^2)^(-3/2) (Vance 1988).
  static const TermEntry entry{
      .label = "damping growing with the orbit",
      .parameters = {{"c_film", "1/(m^2 s)"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // -|z|^2 v
            TermForce f;
            f.damped(p, p.x * p.x + p.y * p.y);
            f.x_x = -2 * p.x * p.vx, f.x_y = -2 * p.y * p.vx, f.y_x = -2 * p.x * p.vy, f.y_y = -2 * p.y * p.vy;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one(a.rate + "*(X1^2 + X3^2)", -1); },
      .rare = true,
  };
  return entry;
}

}  // namespace whirl::identification::terms
