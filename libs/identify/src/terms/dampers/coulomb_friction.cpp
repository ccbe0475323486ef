#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& coulomb_friction() {
  static const TermEntry entry{
      .label = "Coulomb friction",
      .parameters = {{"friction", "m/s^2"}},
      .force =
          [](const TermPoint& p, double slow, std::size_t) {  // -v / sqrt(|v|^2 + slow^2), slow a small speed
            const double v = std::sqrt(p.vx * p.vx + p.vy * p.vy + slow * slow), by = 1 / (v * v * v);
            TermForce f;
            f.damped(p, 1 / v);
            f.x_vx += by * p.vx * p.vx, f.y_vy += by * p.vy * p.vy, f.x_vy = f.y_vx = by * p.vx * p.vy;
            return f;
          },
      .text =
          [](const TermAxis& a, const RotorTerm& t) {
            return one(fmt::format("{}/sqrt(X2^2 + X4^2 + {:.17g})", a.rate, t.reference * t.reference), -1);
          },
      .reference_name = "friction_speed",
      .reference = [](double peak, double frequency, double) { return 1e-3 * peak * frequency; },
      .dry = true,
      .plant = {&rotor::FurtherForces<double>::friction},
      .plant_reference = &rotor::FurtherForces<double>::friction_speed,
      .usual = [](const TermScale& s) { return rules::kOfDamping * s.c * s.v(); },
  };
  return entry;
}

}  // namespace whirl::identification::terms
