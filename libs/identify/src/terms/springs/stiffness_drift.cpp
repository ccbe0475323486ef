#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& stiffness_drift() {
  static const TermEntry entry{
      .label = "stiffness drifting in time",
      .parameters = {{"k1_drift", "1/s^3"}},
      .force =
          [](const TermPoint& p, double since, std::size_t) {
            TermForce f;
            f.displaced(p, p.time - since);
            return f;
          },
      .text = [](const TermAxis& a, const RotorTerm& t) { return one(since(t) + "*" + a.own, -1); },
      .reference_name = "drift_start",
      .reference = [](double, double, double start) { return start; },
      .drifts = true,
      .moves_middle = true,
      .plant = {&rotor::FurtherForces<double>::k1_drift},
      .plant_reference = &rotor::FurtherForces<double>::drift_start,
      .usual = [](const TermScale& s) { return rules::kWarming * s.k1 / s.seconds; },
      .prior = {rules::kCommonTerm, rules::kEitherSign, rules::kAsLikelyAsNot},  // warming
      .decider = Decider::another_rate,
  };
  return entry;
}

}  // namespace whirl::identification::terms
