#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& cross_coupled() {
  static const TermEntry entry{
      .label = "cross-coupled stiffness",
      .parameters = {{"k_cross", "1/s^2"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // i z: seals, journal bearings
            TermForce f;
            f.x = -p.y, f.y = p.x, f.x_y = -1, f.y_x = 1;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one(a.other, a.turn); },
      .drives_whirl = true,
      .plant = {&rotor::FurtherForces<double>::k_cross},
      .usual = [](const TermScale& s) { return rules::kOfDamping * s.c * s.w(); },
      // Seals and journal bearings are common; as a rule they drive the forward whirl (swirl with the rotation).
      .prior = {rules::kCommonTerm, rules::kDriving, rules::kAsLikelyAsNot},
      .decider = Decider::free_decay,
      .hidden_note = "; the damping ratio is that of the forward whirl, c - k_cross / speed",
      .hidden_decider = "a free decay (impact) at rest and at speed",
  };
  return entry;
}

}  // namespace whirl::identification::terms
