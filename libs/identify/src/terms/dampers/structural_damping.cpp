#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& structural_damping() {
  // Loss per turn that does not depend on the frequency: friction in joints and material. In a whirl at w it is
  // the damper loss k / w (Genta 2005, section 3.4); |z| / |v| stands for 1 / w where the motion is any other.
  static const TermEntry entry{
      .label = "structural damping",
      .parameters = {{"k1_loss", "1/s^2"}},
      .force =
          [](const TermPoint& p, double slow, std::size_t) {  // -|z| v / sqrt(|v|^2 + slow^2)
            const double r = std::hypot(p.x, p.y), by_r = r > 0 ? 1 / r : 0;
            const double v = std::sqrt(p.vx * p.vx + p.vy * p.vy + slow * slow), by = r / (v * v * v);
            TermForce f;
            f.damped(p, r / v);
            f.x_vx += by * p.vx * p.vx, f.y_vy += by * p.vy * p.vy, f.x_vy = f.y_vx = by * p.vx * p.vy;
            const double ax = -by_r * p.vx / v, ay = -by_r * p.vy / v;
            f.x_x = ax * p.x, f.x_y = ax * p.y, f.y_x = ay * p.x, f.y_y = ay * p.y;
            return f;
          },
      .text =
          [](const TermAxis& a, const RotorTerm& t) {
            return one(fmt::format("{}*sqrt((X1^2 + X3^2)/(X2^2 + X4^2 + {:.17g}))", a.rate, t.reference * t.reference),
                       -1);
          },
      .reference_name = "loss_speed",
      .reference = [](double peak, double frequency, double) { return 0.02 * peak * frequency; },
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
