#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& quadratic_damping() {
  static const TermEntry entry{
      .label = "quadratic damping",
      .parameters = {{"c2", "1/m"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // -|v| v
            const double v = std::sqrt(p.vx * p.vx + p.vy * p.vy), by = v > 0 ? 1 / v : 0;
            TermForce f;
            f.damped(p, v);
            f.x_vx -= by * p.vx * p.vx, f.y_vy -= by * p.vy * p.vy, f.x_vy = f.y_vx = -by * p.vx * p.vy;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one(a.rate + "*sqrt(X2^2 + X4^2)", -1); },
      .plant = {&rotor::FurtherForces<double>::c2},
      .usual = [](const TermScale& s) { return s.c / s.v(); },
  };
  return entry;
}

}  // namespace whirl::identification::terms
