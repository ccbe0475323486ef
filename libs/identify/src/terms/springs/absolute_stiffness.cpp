#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& absolute_stiffness() {
  // Springs that harden in proportion to the deflection: wound and rubber mounts, rolling bearings under preload.
  static const TermEntry entry{
      .label = "stiffness growing with deflection",
      .parameters = {{"k_radius", "1/(m s^2)"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // -|z| z
            const double r = std::hypot(p.x, p.y), by = r > 0 ? 1 / r : 0;
            TermForce f;
            f.displaced(p, r);
            f.x_x -= by * p.x * p.x, f.y_y -= by * p.y * p.y, f.x_y = f.y_x = -by * p.x * p.y;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one(a.own + "*sqrt(X1^2 + X3^2)", -1); },
      .rare = true,
  };
  return entry;
}

}  // namespace whirl::identification::terms
