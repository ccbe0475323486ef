#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& damping_with_speed() {
  static const TermEntry entry{
      .label = "damping changing with speed",
      .parameters = {{"c_speed", "1/rad"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {
            TermForce f;
            f.damped(p, std::abs(p.w));
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one("abs(X6)*" + a.rate, -1); },
      .moves_middle = true,
      .plant = {&rotor::FurtherForces<double>::c_speed},
      .usual = [](const TermScale& s) { return rules::kDampingChange * s.c / s.top_speed; },
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
