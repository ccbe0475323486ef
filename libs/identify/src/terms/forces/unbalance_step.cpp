#include "terms/step.hpp"

namespace whirl::identification::terms {
namespace {

/// Of the unbalance 1 or i.
TermForce unbalance(const TermPoint& p, double size, std::size_t part) {
  const double c = p.turn().real(), s = p.turn().imag(), square = p.w * p.w;
  const double x = square * c + p.alpha * s, y = square * s - p.alpha * c;
  TermForce f;
  f.x = size * (part == 0 ? x : -y), f.y = size * (part == 0 ? y : x);
  return f;
}

}  // namespace

const TermEntry& unbalance_step() {
  // A blade or a balance mass that flies off, scale that breaks away.
  static const TermEntry entry{
      .label = "unbalance changing at one instant",
      .parameters = {{"eps_step_re", "m"}, {"eps_step_im", "m"}},
      .force = [](const TermPoint& p, double instant,
                  std::size_t part) { return unbalance(p, Step(p, instant).now, part); },
      .by_reference = [](const TermPoint& p, double instant,
                         std::size_t part) { return unbalance(p, Step(p, instant).by_instant, part); },
      .text =
          [](const TermAxis& a, const RotorTerm& t) {
            const bool first = a.x == (t.part == 0);
            return one(before(t) + (first ? "*(X6^2*cos(X5) + X7*sin(X5))" : "*(X6^2*sin(X5) - X7*cos(X5))"),
                       t.part == 1 && a.x ? -1 : 1);
          },
      .reference_name = "unbalance_step_time",
      .external = true,
      .drifts = true,
      .chances = kInstants,
      .hinted = false,
      .rare = true,
      .decider = Decider::second_run,
  };
  return entry;
}

}  // namespace whirl::identification::terms
