#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& damping_drift() {
  static const TermEntry entry{
      .label = "damping drifting in time",
      .parameters = {{"c_drift", "1/s^2"}},
      .force =
          [](const TermPoint& p, double since, std::size_t) {
            TermForce f;
            f.damped(p, p.time - since);
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm& t) { return one(since(t) + "*" + a.rate, -1); },
      .reference_name = "drift_start",
      .reference = [](double, double, double start) { return start; },
      .drifts = true,
      .moves_middle = true,
      .plant = {&rotor::FurtherForces<double>::c_drift},
      .plant_reference = &rotor::FurtherForces<double>::drift_start,
      .usual = [](const TermScale& s) { return rules::kDampingChange * s.c / s.seconds; },
      .decider = Decider::another_rate,
  };
  return entry;
}

}  // namespace whirl::identification::terms
