#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

double Hardware::loop_delay() const {
  const double lag = actuator.bandwidth > 0 ? 1 / (2 * std::numbers::pi * actuator.bandwidth) : 0;
  return laser.latency + actuator.delay_samples / timing.rate + lag;
}

Hardware data_sheet(const rig::RigParameters& rig) {
  Hardware h;
  h.laser.noise = rig.laser.noise;
  h.laser.range = rig.laser.range;
  h.laser.bits = rig.laser.bits;
  h.laser.rate = rig.laser.rate;
  h.laser.latency = rig.laser.latency;
  h.laser.runout_1x = 10e-6, h.laser.runout_2x = 5e-6, h.laser.runout_3x = 2.5e-6;
  h.laser.runout_phase_1x = h.laser.runout_phase_2x = h.laser.runout_phase_3x = 0;
  h.actuator.voltage_limit = rig.actuator.voltage_limit;
  h.actuator.bits = rig.actuator.bits;
  h.actuator.force_per_volt = rig.actuator.force_per_volt;
  h.actuator.bandwidth = rig.actuator.bandwidth;
  h.actuator.delay_samples = rig.actuator.delay_samples;
  h.actuator.gain_error = h.actuator.axis_rotation = 0;
  h.encoder = rig.encoder;
  h.timing = rig.timing;
  h.profile = rig.profile.without_ripple();
  return h;
}

std::vector<rig::RigMode> structure_modes(const ModalModel& modal, double rotor_omega, double participation) {
  std::vector<rig::RigMode> out;
  double sign = 1;
  for (const Mode& mode : modal.modes) {
    if (2 * std::numbers::pi * mode.frequency.value < 1.5 * rotor_omega) continue;  // the rotor's own mode
    out.push_back({mode.frequency.value, std::max(mode.damping.value, 1e-3), participation, sign, 0});
    sign = -sign;  // the shape at the sensor is not known either: both signs occur
  }
  return out;
}

rig::RigParameters tuning_plant(const RotorModel& model, const Hardware& hardware) {
  rig::RigParameters p;
  const double mass = 1 / model.gain;
  p.rotor.mass = mass;
  p.rotor.stiffness = model.k1 * mass;
  p.rotor.cubic = model.k2 * mass;
  p.rotor.damping = model.c * mass;
  p.rotor.stiffness_split = model.k1_conj.real() / model.k1;
  p.rotor.cross_stiffness = model.k1_conj.imag() * mass;
  p.rotor.damping_split = model.c != 0 ? model.c_conj.real() / model.c : 0;
  p.rotor.residual_eccentricity = std::abs(model.eps);
  p.rotor.residual_phase = std::arg(model.eps);
  p.rotor.added_mass = 0;
  p.profile = hardware.profile;
  p.modes = hardware.modes;
  p.laser = hardware.laser;
  p.actuator = hardware.actuator;
  p.encoder = hardware.encoder;
  p.timing = hardware.timing;
  return p;
}

}  // namespace whirl::tuning
