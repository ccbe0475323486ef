#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& stiffness_with_speed() {
  static const TermEntry entry{
      .label = "stiffness changing with speed",
      .parameters = {{"k1_speed", "1/(rad s)"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {
            TermForce f;
            f.displaced(p, std::abs(p.w));
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one("abs(X6)*" + a.own, -1); },
      .moves_middle = true,
      .plant = {&rotor::FurtherForces<double>::k1_speed},
      .usual = [](const TermScale& s) { return rules::kSpringWithSpeed * s.k1 / s.top_speed; },
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
