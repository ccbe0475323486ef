#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& quintic_stiffness() {
  static const TermEntry entry{
      .label = "quintic stiffness",
      .parameters = {{"k3", "1/(m^4 s^2)"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // -|z|^4 z
            const double r2 = p.x * p.x + p.y * p.y;
            TermForce f;
            f.displaced(p, r2 * r2);
            f.x_x -= 4 * r2 * p.x * p.x, f.y_y -= 4 * r2 * p.y * p.y, f.x_y = f.y_x = -4 * r2 * p.x * p.y;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one(a.own + "*(X1^2 + X3^2)^2", -1); },
      .plant = {&rotor::FurtherForces<double>::k3},
      // The next term of a series in |z|^2; springs beyond the cubic are common.
      .usual = [](const TermScale& s) { return s.k2 * s.k2 / s.k1; },
      .plausible = [](const TermScale& s) { return rules::kQuinticAtPeak * s.k1 / std::pow(s.peak, 4); },
      .prior = {rules::kCommonTerm, rules::kEitherSign, rules::kAsLikelyAsNot},
      .hidden_decider = "a run with more unbalance",
  };
  return entry;
}

}  // namespace whirl::identification::terms
