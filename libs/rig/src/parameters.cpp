#include "whirl/rig/parameters.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rig/tilt.hpp"

namespace whirl::rig {

namespace {
constexpr double kMostFrictionPerStep = 1.5;

void make_ideal(RigParameters& p) {
  p.modes.clear();
  p.rotor.stiffness_split = p.rotor.damping_split = p.rotor.cross_stiffness = 0;
  p.laser = RigLaser{
      .noise = 0, .range = 1, .bits = 0, .rate = 0, .latency = 0, .runout_1x = 0, .runout_2x = 0, .runout_3x = 0};
  p.actuator.bits = 0;
  p.actuator.gain_error = p.actuator.axis_rotation = 0;
  p.actuator.bandwidth = 0;
  p.actuator.delay_samples = 0;
  p.encoder.counts = 0;
}

void check_forces(const RigForces& f, const RigRotor& rotor, double step) {
  require_range("forces.quintic", f.quintic, -1e24, 1e24, "N/m^5");
  require_range("forces.cubic_per_axis", f.cubic_per_axis, -1e18, 1e18, "N/m^3");
  require_range("forces.quadratic_damping", f.quadratic_damping, -1e9, 1e9, "N s^2/m^2");
  require_range("forces.friction", f.friction, 0, 1e6, "N");
  require_range("forces.friction_speed", f.friction_speed, 1e-9, 10, "m/s");
  require_range("forces.gyroscopic", f.gyroscopic, -rotor.mass, rotor.mass, "kg");
  require_range("forces.rotating_damping", f.rotating_damping, -1e9, 1e9, "N s/m");
  require_range("forces.cross_coupling", f.cross_coupling, -1e12, 1e12, "N/m");
  require_range("forces.stiffness_with_speed", f.stiffness_with_speed, -1e9, 1e9, "N s/(m rad)");
  require_range("forces.damping_with_speed", f.damping_with_speed, -1e9, 1e9, "N s^2/(m rad)");
  require_range("forces.stiffness_drift", f.stiffness_drift, -1e12, 1e12, "N/(m s)");
  require_range("forces.damping_drift", f.damping_drift, -1e9, 1e9, "N/m");
  require_range("forces.drift_start", f.drift_start, -1e9, 1e9, "s");
  for (const auto& [field, value] :
       {std::pair{"forces.quadratic_x", f.quadratic_x}, std::pair{"forces.quadratic_y", f.quadratic_y},
        std::pair{"forces.quadratic_xxy", f.quadratic_xxy}, std::pair{"forces.quadratic_xyy", f.quadratic_xyy}})
    require_range(field, value, -1e15, 1e15, "N/m^2");
  // At rest friction is a damper of friction / friction_speed, which the Runge-Kutta steps must follow: they are stable
  // to 2.78 per step.
  const double rate = f.friction / (rotor.mass * f.friction_speed);
  if (rate * step > kMostFrictionPerStep) {
    throw Error::in_field(
        "forces.friction_speed", fmt::format("{:g} m/s", f.friction_speed),
        fmt::format("at least {:.2g} m/s with {:g} N on {:g} kg and {:g} s from step to step, or "
                    "more timing.substeps",
                    f.friction * step / (kMostFrictionPerStep * rotor.mass), f.friction, rotor.mass, step));
  }
}

bool whole(double x) { return std::abs(x - std::round(x)) < 1e-9 * std::max(1.0, std::abs(x)); }
}  // namespace

rotor::SpeedProfile RigParameters::default_profile() {
  rotor::SpeedProfile p = rotor::SpeedProfile::run_down(2.5 * std::sqrt(8500 / 1.5), 13, 1);
  p.ripple = 0.004;
  p.ripple_omega = kTwoPi * 0.7;
  p.ripple_phase = 3.4;
  return p;
}

std::vector<RigMode> RigParameters::default_modes() {
  return {{46, 0.008, 0.030, 1, 30e-6}, {128, 0.006, 0.015, -1, 8e-6}, {310, 0.010, 0.010, 1, 2e-6}};
}

RigParameters RigParameters::ideal_rotor_a() {
  RigParameters p;
  make_ideal(p);
  const double w2 = std::pow(kTwoPi * 12, 2);
  p.rotor.mass = 2.5;
  p.rotor.stiffness = 2.5 * w2;
  p.rotor.cubic = 0.25 * p.rotor.stiffness / 9e-6;
  p.rotor.damping = 2 * 0.02 * kTwoPi * 12 * 2.5;
  p.rotor.residual_eccentricity = 80e-6;
  p.rotor.residual_phase = 0.7;
  p.rotor.added_radius = 85e-3;
  p.rotor.added_phase = 1.2;
  p.profile = rotor::SpeedProfile::run_down(kTwoPi * 30, 12);
  return p;
}

RigParameters RigParameters::ideal_rotor_b() {
  RigParameters p;
  make_ideal(p);
  p.rotor.mass = 1;
  p.rotor.stiffness = 8882.6;
  p.rotor.cubic = 2e8;
  p.rotor.damping = 7.5;
  p.rotor.residual_eccentricity = 300e-6;
  p.rotor.residual_phase = 0;
  p.rotor.added_mass = 0;
  p.profile = rotor::SpeedProfile::run_down(kTwoPi * 40, 15);
  return p;
}

rotor::GyroscopicRotor gyroscopic_rotor(const RigParameters& p) {
  if (!p.tilt.active()) throw Error("the rig's rotor has no tilt: tilt.diametral is 0");
  rotor::GyroscopicRotor r;
  r.mass = p.rotor.mass;
  r.polar = p.tilt.polar;
  r.diametral = p.tilt.diametral;
  r.shaft = {p.rotor.stiffness + p.tilt.coupling * p.tilt.coupling / p.tilt.stiffness, p.tilt.coupling,
             p.tilt.stiffness};
  r.damping = p.rotor.damping;
  r.tilt_damping = 2 * p.tilt.damping_ratio * std::sqrt(p.tilt.stiffness * p.tilt.diametral);
  r.cubic = p.rotor.cubic;
  r.eps = p.eccentricity();
  r.chi = std::polar(p.tilt.couple_unbalance, p.tilt.couple_phase);
  return r;
}

double RigParameters::natural_frequency() const {
  if (tilt.active()) return rotor::critical_speeds(gyroscopic_rotor(*this)).front();
  return std::sqrt(rotor.stiffness / rotor.mass);
}

std::complex<double> RigParameters::eccentricity() const {
  return std::polar(rotor.residual_eccentricity, rotor.residual_phase) +
         std::polar(rotor.added_mass * rotor.added_radius / rotor.mass, rotor.added_phase);
}

RotorModel RigParameters::true_model() const {
  const double m = rotor.mass;
  RotorModel model;
  model.k1 = rotor.stiffness / m;
  model.k2 = rotor.cubic / m;
  model.c = rotor.damping / m;
  model.k1_conj = {rotor.stiffness * rotor.stiffness_split / m, rotor.cross_stiffness / m};
  model.c_conj = rotor.damping * rotor.damping_split / m;
  model.eps = eccentricity();
  model.gain = 1 / m;
  for (const RigMode& mode : modes) {
    if (mode.unbalance_share == 0) continue;
    model.modes.push_back(
        {kTwoPi * mode.frequency, mode.damping_ratio, mode.sensor_sign * mode.unbalance_share * model.eps});
  }
  return model;
}

rotor::FurtherForces<double> RigForces::per_mass(double mass) const {
  return {quintic / mass,
          cubic_per_axis / mass,
          quadratic_damping / mass,
          friction / mass,
          friction_speed,
          gyroscopic / mass,
          rotating_damping / mass,
          cross_coupling / mass,
          stiffness_with_speed / mass,
          damping_with_speed / mass,
          stiffness_drift / mass,
          damping_drift / mass,
          drift_start,
          quadratic_x / mass,
          quadratic_y / mass,
          quadratic_xxy / mass,
          quadratic_xyy / mass};
}

RigForces RigForces::of(const rotor::FurtherForces<double>& f, double mass) {
  return {f.k3 * mass,
          f.k2_axis * mass,
          f.c2 * mass,
          f.friction * mass,
          f.friction != 0 ? f.friction_speed : RigForces{}.friction_speed,
          f.gyroscopic * mass,
          f.c_rotating * mass,
          f.k_cross * mass,
          f.k1_speed * mass,
          f.c_speed * mass,
          f.k1_drift * mass,
          f.c_drift * mass,
          f.drift_start,
          f.kq_x * mass,
          f.kq_y * mass,
          f.kq_xxy * mass,
          f.kq_xyy * mass};
}

RigParameters RigParameters::run_up() const {
  RigParameters p = *this;
  std::swap(p.profile.omega_start, p.profile.omega_end);
  std::swap(p.profile.dwell_start, p.profile.dwell_end);
  return p;
}

void RigParameters::check() const {
  const auto positive = [](const char* field, double value, double high, const char* unit) {
    require_range(field, value, 1e-12, high, unit);
  };
  positive("rotor.mass", rotor.mass, 1e6, "kg");
  positive("rotor.stiffness", rotor.stiffness, 1e12, "N/m");
  require_range("rotor.cubic", rotor.cubic, -1e18, 1e18, "N/m^3");
  require_range("rotor.damping", rotor.damping, 0, 1e9, "N s/m");
  require_range("rotor.stiffness_split", rotor.stiffness_split, -0.99, 0.99);
  require_range("rotor.damping_split", rotor.damping_split, -1, 1);
  require_range("rotor.cross_stiffness", rotor.cross_stiffness, -rotor.stiffness, rotor.stiffness, "N/m");
  require_range("rotor.residual_eccentricity", rotor.residual_eccentricity, 0, 1, "m");
  require_range("rotor.added_mass", rotor.added_mass, 0, rotor.mass, "kg");
  require_range("rotor.added_radius", rotor.added_radius, 0, 10, "m");
  profile.check();
  for (const RigMode& mode : modes) {
    positive("modes.frequency", mode.frequency, 1e6, "Hz");
    require_range("modes.damping_ratio", mode.damping_ratio, 0, 10);
  }
  require_range("laser.noise", laser.noise, 0, 1, "m");
  positive("laser.range", laser.range, 10, "m");
  require_range("laser.bits", laser.bits, 0, 32);
  require_range("laser.rate", laser.rate, 0, 1e7, "Hz");
  require_range("laser.latency", laser.latency, 0, 50 / timing.rate, "s");
  require_range("laser.bandwidth", laser.bandwidth, 0, 1e7, "Hz");
  require_range("laser.hysteresis", laser.hysteresis, 0, laser.range, "m");
  positive("actuator.voltage_limit", actuator.voltage_limit, 1e6, "V");
  positive("actuator.force_per_volt", actuator.force_per_volt, 1e9, "N/V");
  require_range("actuator.bits", actuator.bits, 0, 32);
  require_range("actuator.gain_error", actuator.gain_error, -1, 10);
  require_range("actuator.bandwidth", actuator.bandwidth, 0, 1e6, "Hz");
  require_range("actuator.delay_samples", actuator.delay_samples, 0, 30);
  require_range("actuator.extra_delay_samples", actuator.extra_delay_samples, 0, 30);
  require_range("actuator.current_limit", actuator.current_limit, 0, 1e6, "A");
  require_range("actuator.force_per_ampere", actuator.force_per_ampere, 0, 1e9, "N/A");
  if (actuator.current_limit > 0 && actuator.force_per_ampere == 0)
    throw Error("actuator.current_limit_A limits no force without the force constant: state actuator.force_N_A");
  require_range("actuator.slew", actuator.slew, 0, 1e12, "N/s");
  require_range("actuator.hysteresis", actuator.hysteresis, 0, 1e6, "N");
  require_range("encoder.counts", encoder.counts, 0, 1e9);
  positive("encoder.bandwidth", encoder.bandwidth, timing.rate / 20, "Hz");
  positive("timing.rate", timing.rate, 1e6, "Hz");
  require_range("timing.substeps", timing.substeps, 1, 256);

  if (tilt.active()) {
    require_range("tilt.diametral", tilt.diametral, 1e-12, 1e6, "kg m^2");
    require_range("tilt.polar", tilt.polar, 0, 2 * tilt.diametral, "kg m^2");  // a rigid body: Ip <= 2 Id
    positive("tilt.stiffness", tilt.stiffness, 1e12, "N m");
    require_range("tilt.coupling", tilt.coupling, -1e12, 1e12, "N");
    require_range("tilt.damping_ratio", tilt.damping_ratio, 0, 10);
    require_range("tilt.couple_unbalance", tilt.couple_unbalance, 0, 1, "rad");
  }

  check_forces(forces, rotor, 1 / (timing.rate * timing.substeps));

  // Sensor instants must be ends of Runge-Kutta steps: interpolating between them would be a sensor nobody
  // sells.
  const double step_rate = timing.rate * timing.substeps;
  if (laser.rate > 0 && !whole(step_rate / laser.rate)) {
    throw Error::in_field("timing.substeps", fmt::format("{}", timing.substeps),
                          fmt::format("such that rate x substeps ({:g} Hz) is a multiple of laser.rate ({:g} Hz)",
                                      step_rate, laser.rate));
  }
  if (laser.rate == 0 && !whole(laser.latency * step_rate)) {
    throw Error::in_field("laser.latency", fmt::format("{:g} s", laser.latency),
                          fmt::format("a whole number of substeps of {:g} s", 1 / step_rate));
  }
}

}  // namespace whirl::rig
