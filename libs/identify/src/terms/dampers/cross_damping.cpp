#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& cross_damping() {
  // Seals and pumps: the damping of the fluid that swirls.
  static const TermEntry entry{
      .label = "cross-coupled damping",
      .parameters = {{"c_cross", "1/s"}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // i v
            TermForce f;
            f.x = -p.vy, f.y = p.vx, f.x_vy = -1, f.y_vx = 1;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one(a.other_rate, a.turn); },
      .rare = true,
      // As cross-coupled stiffness, with which it comes: near one speed it is a spring.
      .usual = [](const TermScale& s) { return rules::kOfDamping * s.c; },
      .prior = {rules::kRareTerm, rules::kEitherSign, rules::kAsLikelyAsNot},
      .decider = Decider::free_decay,
      .hidden_note = "; k1 is that of the forward whirl, k1 + c_cross * speed",
      .hidden_decider = "a free decay (impact) at rest and at speed",
  };
  return entry;
}

}  // namespace whirl::identification::terms
