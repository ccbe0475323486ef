#include <algorithm>
#include <cmath>

#include "output_error/rotor/output_error_kernel.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/rotor/equations.hpp"

namespace whirl::identification {
namespace {

/// Fastest free motion of the rotor with its further forces, rad/s.
double free_frequency(const RotorModel& rotor, const std::vector<RotorTerm>& terms, double radius, double speed) {
  double squared = std::pow(rotor::free_frequency(rotor, radius), 2), dry = 0;
  for (const RotorTerm& term : terms) {
    const double size = std::abs(term.value);
    if (term.entry->dry) {  // reversal at rest: a rate of its own
      if (term.reference > 0) dry = 0.2 * size / term.reference;
      continue;
    }
    const TermForce f = term_force(term, {.x = radius, .w = speed, .time = term.reference});
    squared += size * std::abs(f.x_x) + std::pow(size * f.x_vy, 2);
  }
  return std::max(std::sqrt(squared), dry);
}

}  // namespace

rotor::Response simulate_rotor(const IdentifiedModel& model, const AngleSignal& angle) {
  if (!model.rotor) throw Error("the model has no rotor parameters");
  const RotorModel& rotor = *model.rotor;
  const std::vector<RotorTerm> terms = terms_of(model);
  if (terms.empty()) return rotor::simulate(rotor, angle);
  const rotor::WhirlState start = rotor::steady_whirl(rotor, angle.omega[0], angle.beta[0]);
  const double speed = angle.omega.cwiseAbs().maxCoeff();
  const auto needed = [&](double radius) {
    return rotor::steps_per_sample(angle.dt, free_frequency(rotor, terms, radius, speed), speed);
  };
  rotor::Response out;
  out.dt = angle.dt;
  int substeps = needed(std::abs(start.z));
  while (true) {
    const AngleSignal fine = rotor::refine(angle, substeps);
    detail::MainMotion motion = detail::main_mode(rotor, rotor.eps, rotor::unbalance_forcing(fine), {terms, fine, 0.0},
                                                  {angle.dt, substeps}, start.z, start.dz);
    out.z = std::move(motion.z);
    out.dz = std::move(motion.v);
    // A harder spring far out is a faster motion.
    const double radius = out.z.cwiseAbs().maxCoeff();
    const int more = std::isfinite(radius) ? needed(radius) : 0;
    if (more <= substeps) break;
    substeps = more;
  }
  if (!rotor.modes.empty()) {  // they follow the same forcing whatever the main mode does
    RotorModel without = rotor;
    without.k2 = 0;
    without.modes.clear();
    RotorModel with = without;
    with.modes = rotor.modes;
    const rotor::Response a = rotor::simulate(with, angle, {}, substeps),
                          b = rotor::simulate(without, angle, {}, substeps);
    out.z += a.z - b.z;
    out.dz += a.dz - b.dz;
  }
  out.z.array() += rotor.offset;
  return out;
}

}  // namespace whirl::identification
