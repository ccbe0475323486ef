#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& structural_damping() {
  // Loss per turn that does not depend on the frequency: friction in joints and material. In a whirl at the speed w it
  // is the damper loss / w (Genta 2005, section 3.4).
  static const TermEntry entry{
      .label = "structural damping",
      .parameters = {{"k1_loss", "1/s^2"}},
      .force =
          [](const TermPoint& p, double slow, std::size_t) {
            TermForce f;
            f.damped(p, 1 / std::hypot(p.w, slow));
            return f;
          },
      .text =
          [](const TermAxis& a, const RotorTerm& t) {
            return one(fmt::format("{}/sqrt(X6^2 + {:.17g})", a.rate, t.reference * t.reference), -1);
          },
      .reference_name = "loss_speed",
      .reference = [](double, double frequency, double) { return 0.02 * frequency; },
      .rare = true,
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
