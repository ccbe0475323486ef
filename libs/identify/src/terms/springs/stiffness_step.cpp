#include "terms/step.hpp"

namespace whirl::identification::terms {

const TermEntry& stiffness_step() {
  // A crack that opens, a bolt that lets go, a bearing that seats itself.
  static const TermEntry entry{
      .label = "stiffness changing at one instant",
      .parameters = {{"k1_step", "1/s^2"}},
      .force =
          [](const TermPoint& p, double instant, std::size_t) {
            TermForce f;
            f.displaced(p, Step(p, instant).now);
            return f;
          },
      .by_reference =
          [](const TermPoint& p, double instant, std::size_t) {
            TermForce f;
            f.displaced(p, Step(p, instant).by_instant);
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm& t) { return one(before(t) + "*" + a.own, -1); },
      .reference_name = "stiffness_step_time",
      .drifts = true,
      .chances = kInstants,
      .hinted = false,
      .rare = true,
      .decider = Decider::second_run,
  };
  return entry;
}

}  // namespace whirl::identification::terms
