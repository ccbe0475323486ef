#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& bow_growth() {
  // A shaft that heats on one side, as by a rub or a seal, bends more and more: force (t - start) e^{i b}.
  static const TermEntry entry{
      .label = "bow growing in time",
      .parameters = {{"bow_growth_re", "m/s^3"}, {"bow_growth_im", "m/s^3"}},
      .force =
          [](const TermPoint& p, double since, std::size_t part) {
            const double c = (p.time - since) * p.turn().real(), s = (p.time - since) * p.turn().imag();
            return TermForce{.x = part == 0 ? c : -s, .y = part == 0 ? s : c};
          },
      .text =
          [](const TermAxis& a, const RotorTerm& t) {
            return one(since(t) + ((t.part == 0) == a.x ? "*cos(X5)" : "*sin(X5)"), t.part == 1 && a.x ? -1 : 1);
          },
      .reference_name = "drift_start",
      .reference = [](double, double, double start) { return start; },
      .external = true,
      .drifts = true,
      .parts_of_one_axis = 2,
      .hinted = false,
      .rare = true,
      .decider = Decider::another_rate,
  };
  return entry;
}

}  // namespace whirl::identification::terms
