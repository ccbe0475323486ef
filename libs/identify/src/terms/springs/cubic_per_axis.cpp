#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& cubic_per_axis() {
  static const TermEntry entry{
      .label = "cubic stiffness per axis",
      .parameters = {{"k2_axis", "1/(m^2 s^2)"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // -(x^3 + i y^3): springs along the axes
            TermForce f;
            f.x = -p.x * p.x * p.x, f.y = -p.y * p.y * p.y, f.x_x = -3 * p.x * p.x, f.y_y = -3 * p.y * p.y;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one(a.own + "^3", -1); },
      .plant = {&rotor::FurtherForces<double>::k2_axis},
  };
  return entry;
}

}  // namespace whirl::identification::terms
