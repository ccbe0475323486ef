#pragma once
#include <fmt/format.h>

#include "whirl/core/angles.hpp"
#include "whirl/rig/parameters.hpp"

namespace whirl::rig {

/// What the data sheets of converter, amplifier and actuator state, and what they do not.
template <class Actuator, class Visitor>
void visit_actuator(Actuator& a, Visitor& visit) {
  visit("actuator.voltage_limit_V", a.voltage_limit, 1.0);
  visit("actuator.bits", a.bits, 1.0);
  visit("actuator.force_N_V", a.force_per_volt, 1.0);
  visit("actuator.gain_error_percent", a.gain_error, 1e-2);
  visit("actuator.axis_rotation_deg", a.axis_rotation, kRadPerDegree);
  visit("actuator.bandwidth_hz", a.bandwidth, 1.0);
  visit("actuator.delay_samples", a.delay_samples, 1.0);
  visit("actuator.extra_delay_samples", a.extra_delay_samples, 1.0);
  visit("actuator.current_limit_A", a.current_limit, 1.0);
  visit("actuator.force_N_A", a.force_per_ampere, 1.0);
  visit("actuator.slew_N_s", a.slew, 1.0);
  visit("actuator.hysteresis_N", a.hysteresis, 1.0);
  visit("actuator.turns_held_force", a.turns_held_force, 1.0);
}

/// Calls visitor(key, field, unit) for every scalar of the rig, so that files can read and write it: `key`
/// ends in the unit's suffix ("laser.noise_um", "rotor.stiffness_N_m"), the field is a double&, int& or bool&
/// in SI, and file value * unit = SI value (unit 1 for int and bool). Modes are visited as modes.1.*,
/// modes.2.*, ...; their number does not change.
template <class Parameters, class Visitor>
void visit_fields(Parameters& p, Visitor&& visit) {
  constexpr double kUm = 1e-6, kMm = 1e-3, kMs = 1e-3, kGram = 1e-3, kPercent = 1e-2;
  visit("rotor.mass_kg", p.rotor.mass, 1.0);
  visit("rotor.stiffness_N_m", p.rotor.stiffness, 1.0);
  visit("rotor.cubic_N_m3", p.rotor.cubic, 1.0);
  visit("rotor.damping_Ns_m", p.rotor.damping, 1.0);
  visit("rotor.stiffness_split_percent", p.rotor.stiffness_split, kPercent);
  visit("rotor.damping_split_percent", p.rotor.damping_split, kPercent);
  visit("rotor.cross_stiffness_N_m", p.rotor.cross_stiffness, 1.0);
  visit("rotor.residual_eccentricity_um", p.rotor.residual_eccentricity, kUm);
  visit("rotor.residual_phase_rad", p.rotor.residual_phase, 1.0);
  visit("rotor.added_mass_g", p.rotor.added_mass, kGram);
  visit("rotor.added_radius_mm", p.rotor.added_radius, kMm);
  visit("rotor.added_phase_rad", p.rotor.added_phase, 1.0);
  visit("profile.start_rpm", p.profile.omega_start, kRadPerSecPerRpm);
  visit("profile.end_rpm", p.profile.omega_end, kRadPerSecPerRpm);
  visit("profile.dwell_start_s", p.profile.dwell_start, 1.0);
  visit("profile.ramp_s", p.profile.ramp_time, 1.0);
  visit("profile.dwell_end_s", p.profile.dwell_end, 1.0);
  visit("profile.ripple_percent", p.profile.ripple, kPercent);
  visit("profile.ripple_frequency_rpm", p.profile.ripple_omega, kRadPerSecPerRpm);
  visit("profile.ripple_phase_rad", p.profile.ripple_phase, 1.0);
  visit("profile.angle_start_rad", p.profile.beta_start, 1.0);
  int number = 1;
  for (auto& mode : p.modes) {
    const auto key = [&](const char* name) { return fmt::format("modes.{}.{}", number, name); };
    visit(key("frequency_hz"), mode.frequency, 1.0);
    visit(key("damping_percent"), mode.damping_ratio, kPercent);
    visit(key("participation"), mode.participation, 1.0);
    visit(key("sensor_sign"), mode.sensor_sign, 1.0);
    visit(key("initial_um"), mode.initial, kUm);
    visit(key("unbalance_share"), mode.unbalance_share, 1.0);
    ++number;
  }
  visit("laser.noise_um", p.laser.noise, kUm);
  visit("laser.range_mm", p.laser.range, kMm);
  visit("laser.bits", p.laser.bits, 1.0);
  visit("laser.rate_hz", p.laser.rate, 1.0);
  visit("laser.latency_ms", p.laser.latency, kMs);
  visit("laser.bandwidth_hz", p.laser.bandwidth, 1.0);
  visit("laser.hysteresis_um", p.laser.hysteresis, kUm);
  visit("laser.runout_1x_um", p.laser.runout_1x, kUm);
  visit("laser.runout_2x_um", p.laser.runout_2x, kUm);
  visit("laser.runout_3x_um", p.laser.runout_3x, kUm);
  visit("laser.runout_phase_1x_rad", p.laser.runout_phase_1x, 1.0);
  visit("laser.runout_phase_2x_rad", p.laser.runout_phase_2x, 1.0);
  visit("laser.runout_phase_3x_rad", p.laser.runout_phase_3x, 1.0);
  visit_actuator(p.actuator, visit);
  visit("encoder.counts", p.encoder.counts, 1.0);
  visit("encoder.bandwidth_hz", p.encoder.bandwidth, 1.0);
  visit("encoder.profile_angle", p.encoder.profile_angle, 1.0);
  visit("timing.rate_hz", p.timing.rate, 1.0);
  visit("timing.substeps", p.timing.substeps, 1.0);
  visit("tilt.polar_kgm2", p.tilt.polar, 1.0);
  visit("tilt.diametral_kgm2", p.tilt.diametral, 1.0);
  visit("tilt.stiffness_Nm", p.tilt.stiffness, 1.0);
  visit("tilt.coupling_N", p.tilt.coupling, 1.0);
  visit("tilt.damping_percent", p.tilt.damping_ratio, kPercent);
  visit("tilt.couple_unbalance_deg", p.tilt.couple_unbalance, kRadPerDegree);
  visit("tilt.couple_phase_rad", p.tilt.couple_phase, 1.0);
  visit("forces.quintic_N_m5", p.forces.quintic, 1.0);
  visit("forces.cubic_per_axis_N_m3", p.forces.cubic_per_axis, 1.0);
  visit("forces.quadratic_damping_Ns2_m2", p.forces.quadratic_damping, 1.0);
  visit("forces.friction_N", p.forces.friction, 1.0);
  visit("forces.friction_speed_mm_s", p.forces.friction_speed, kMm);
  visit("forces.gyroscopic_kg", p.forces.gyroscopic, 1.0);
  visit("forces.rotating_damping_Ns_m", p.forces.rotating_damping, 1.0);
  visit("forces.cross_coupling_N_m", p.forces.cross_coupling, 1.0);
  visit("forces.stiffness_with_speed_Ns_m", p.forces.stiffness_with_speed, 1.0);
  visit("forces.damping_with_speed_Ns2_m", p.forces.damping_with_speed, 1.0);
  visit("forces.stiffness_drift_N_ms", p.forces.stiffness_drift, 1.0);
  visit("forces.damping_drift_N_m", p.forces.damping_drift, 1.0);
  visit("forces.drift_start_s", p.forces.drift_start, 1.0);
  visit("forces.quadratic_x_N_m2", p.forces.quadratic_x, 1.0);
  visit("forces.quadratic_y_N_m2", p.forces.quadratic_y, 1.0);
  visit("forces.quadratic_xxy_N_m2", p.forces.quadratic_xxy, 1.0);
  visit("forces.quadratic_xyy_N_m2", p.forces.quadratic_xyy, 1.0);
}

}  // namespace whirl::rig
