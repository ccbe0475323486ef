#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& gyroscopic() {
  static const TermEntry entry{
      .label = "gyroscopic term",
      .parameters = {{"gyroscopic", ""}},
      .force =
          [](const TermPoint& p, double, std::size_t) {  // i w v: a disc that tilts with the shaft
            TermForce f;
            f.x = -p.w * p.vy, f.y = p.w * p.vx, f.x_vy = -p.w, f.y_vx = p.w;
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm&) { return one("X6*" + a.other_rate, a.turn); },
      .plant = {&rotor::FurtherForces<double>::gyroscopic},
      .usual = [](const TermScale&) { return double{rules::kGyroscopic}; },
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
