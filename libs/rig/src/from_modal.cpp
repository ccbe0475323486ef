#include "whirl/rig/from_modal.hpp"

#include <fmt/format.h>

#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::rig {

RigParameters rig_from_modal(const ModalModel& modal, Eigen::Index channel, const RigParameters& base) {
  struct Oscillator {
    double omega, zeta, inverse_mass;
  };
  std::vector<Oscillator> found;
  const Oscillator* rotor = nullptr;
  double compliance = 0;
  found.reserve(modal.modes.size());
  for (const Mode& mode : modal.modes) {
    if (channel < 0 || channel >= mode.residues.size()) {
      throw Error::in_field("channel", fmt::format("{}", channel), fmt::format("0 to {}", mode.residues.size() - 1));
    }
    // Modes outside the band stand for what its residuals cannot.
    if (modal.band_high > 0 && !(mode.frequency.value >= modal.band_low && mode.frequency.value <= modal.band_high)) {
      continue;
    }
    const double omega = std::abs(mode.pole);
    const double inverse_mass = -2 * mode.pole.imag() * mode.residues[channel].imag();
    found.push_back({omega, -mode.pole.real() / omega, inverse_mass});
    if (inverse_mass / (omega * omega) > compliance) {
      compliance = inverse_mass / (omega * omega);
      rotor = &found.back();
    }
  }
  if (rotor == nullptr) throw Error("modal model: no mode with a positive modal mass at this drive point");

  RigParameters p = base;
  p.rotor.mass = 1 / rotor->inverse_mass;
  p.rotor.stiffness = rotor->omega * rotor->omega * p.rotor.mass;
  p.rotor.damping = 2 * rotor->zeta * rotor->omega * p.rotor.mass;
  p.modes.clear();
  for (const Oscillator& o : found) {
    if (std::abs(o.omega / rotor->omega - 1) < 0.05) continue;  // the rotor itself or its other axis
    const double ratio = o.inverse_mass / rotor->inverse_mass;
    p.modes.push_back({o.omega / (2 * std::numbers::pi), o.zeta, std::abs(ratio), ratio < 0 ? -1.0 : 1.0, 0});
  }
  p.check();
  return p;
}

}  // namespace whirl::rig
