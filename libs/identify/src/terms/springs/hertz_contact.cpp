#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& hertz_contact() {
  // Ball or roller pressed into its race without clearance: force as deflection to the power 3/2 (Hertz 1881).
  static const TermEntry entry{
      .label = "Hertz contact",
      .parameters = {{"k_hertz", "1/(m^0.5 s^2)"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // -|z|^(1/2) z
            const double r2 = p.x * p.x + p.y * p.y, g = std::sqrt(std::sqrt(r2)), by = r2 > 0 ? 0.5 * g / r2 : 0;
            TermForce f;
            f.displaced(p, g);
            f.x_x -= by * p.x * p.x, f.y_y -= by * p.y * p.y, f.x_y = f.y_x = -by * p.x * p.y;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one(a.own + "*sqrt(sqrt(X1^2 + X3^2))", -1); },
      .rare = true,
  };
  return entry;
}

}  // namespace whirl::identification::terms
