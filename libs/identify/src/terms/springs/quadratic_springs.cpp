#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& quadratic_springs() {
  // Stiffer to one side: bearings and magnets under weight or preload, a support that lifts, a bent support. The
  // gradient of x^3 / 3, y^3 / 3, x^2 y and x y^2.
  static const TermEntry entry{
      .label = "springs stiffer to one side",
      .parameters = {{"kq_x", "1/(m s^2)"}, {"kq_y", "1/(m s^2)"}, {"kq_xxy", "1/(m s^2)"}, {"kq_xyy", "1/(m s^2)"}},
      .force =
          [](const TermPoint& p, double, std::size_t part) {
            const double along_x = part == 0 ? p.x : 0, along_y = part == 1 ? p.y : 0;
            TermForce f;
            f.x_x = -2 * (part == 2 ? p.y : along_x), f.y_y = -2 * (part == 3 ? p.x : along_y);
            if (part > 1) f.x_y = f.y_x = -2 * (part == 2 ? p.x : p.y);
            f.x = 0.5 * (f.x_x * p.x + f.x_y * p.y), f.y = 0.5 * (f.y_x * p.x + f.y_y * p.y);
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm& t) -> std::vector<TermText> {
        if (t.part < 2) return a.x == (t.part == 0) ? one(a.own + "^2", -1) : std::vector<TermText>{};
        return a.x == (t.part == 2) ? one("X1*X3", -2) : one(a.other + "^2", -1);
      },
      .parts_of_one_axis = 1,
      .plant = {&rotor::FurtherForces<double>::kq_x, &rotor::FurtherForces<double>::kq_y,
                &rotor::FurtherForces<double>::kq_xxy, &rotor::FurtherForces<double>::kq_xyy},
      .rare = true,
  };
  return entry;
}

}  // namespace whirl::identification::terms
