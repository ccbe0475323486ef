#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& rotating_damping() {
  static const TermEntry entry{
      .label = "rotating damping",
      .parameters = {{"c_rotating", "1/s"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // -(v - i w z): internal damping of the shaft
            TermForce f;
            f.damped(p, 1);
            f.x -= p.w * p.y, f.y += p.w * p.x, f.x_y = -p.w, f.y_x = p.w;
            return f;
          },
      .text =
          [](const TermAxis& a, const RotorTerm&) {
            return std::vector<TermText>{{a.rate, -1}, {"X6*" + a.other, a.turn}};
          },
      .drives_whirl = true,
      .plant = {&rotor::FurtherForces<double>::c_rotating},
      .usual = [](const TermScale& s) { return rules::kOfDamping * s.c; },
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
