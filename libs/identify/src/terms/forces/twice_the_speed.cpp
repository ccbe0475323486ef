#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& twice_the_speed() {
  // w^2 e^{2 i b} and w^2 e^{-2 i b}: misalignment, shafts of unequal stiffness under weight; both together are a force
  // along a fixed direction.
  static const TermEntry entry{
      .label = "force at twice the speed",
      .parameters = {{"e2_forward_re", "m"}, {"e2_forward_im", "m"}, {"e2_backward_re", "m"}, {"e2_backward_im", "m"}},
      .force =
          [](const TermPoint& p, double, std::size_t part) {
            const double c = p.w * p.w * p.turn_twice().real(), s = p.w * p.w * p.turn_twice().imag();
            TermForce f;
            f.x = part % 2 == 0 ? c : part == 1 ? -s : s;
            f.y = part % 2 == 1 ? c : part == 0 ? s : -s;
            return f;
          },
      .text =
          [](const TermAxis& a, const RotorTerm& t) {
            const bool cosine = a.x == (t.part % 2 == 0);
            const double sign = t.part == 0 || t.part == 3 ? 1 : t.part == 1 ? a.turn : -a.turn;
            return one(cosine ? "X6^2*cos(2*X5)" : "X6^2*sin(2*X5)", sign);
          },
      .external = true,
      .twice_a_turn = true,
      .parts_of_one_axis = 2,
      .plain_threshold = true,
      .hinted = false,
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
