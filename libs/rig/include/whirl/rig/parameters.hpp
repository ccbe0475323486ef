#pragma once
#include <complex>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "whirl/core/rotor_model.hpp"
#include "whirl/rotor/further_forces.hpp"
#include "whirl/rotor/speed_profile.hpp"

namespace whirl::rig {

/// The true rotor. Defaults: 6 mm steel shaft, 11.98 Hz, damping ratio 0.66 %, cubic force 7 % of the linear
/// one at 6.45 mm. Anisotropy is what a controller's isotropic model does not know.
struct RigRotor {
  double mass = 1.5;                       ///< m, kg
  double stiffness = 8500;                 ///< K1, N/m
  double cubic = 1.5e7;                    ///< K2, N/m^3, radial
  double damping = 1.5;                    ///< C, N s/m
  double stiffness_split = 0.02;           ///< K_x, K_y = K1 (1 +- split)
  double damping_split = 0.10;             ///< C_x, C_y = C (1 +- split)
  double cross_stiffness = 40;             ///< K_xy = K_yx, N/m
  double residual_eccentricity = 51.3e-6;  ///< e0 of the balanced rotor, m
  double residual_phase = 0.6;             ///< of e0, rad from the angle zero
  double added_mass = 5e-3;                ///< screw in the disk, kg
  double added_radius = 82.73e-3;          ///< m
  double added_phase = 0;                  ///< rad from the angle zero
};

/// Further forces on the disk (whirl/rotor/further_forces.hpp), as `whirl identify` may find them. Default: none.
struct RigForces {
  double quintic = 0;               ///< N/m^5, radial
  double cubic_per_axis = 0;        ///< N/m^3
  double quadratic_damping = 0;     ///< N s^2/m^2
  double friction = 0;              ///< Coulomb, N
  double friction_speed = 1e-3;     ///< below it the friction falls to zero, m/s
  double gyroscopic = 0;            ///< force per speed and velocity, kg
  double rotating_damping = 0;      ///< of the shaft itself, N s/m
  double cross_coupling = 0;        ///< of seals and journal bearings, N/m
  double stiffness_with_speed = 0;  ///< N/m per rad/s
  double damping_with_speed = 0;    ///< N s/m per rad/s
  double stiffness_drift = 0;       ///< N/m per s
  double damping_drift = 0;         ///< N s/m per s
  double drift_start = 0;           ///< time of the run at which stiffness and damping are those of RigRotor, s
  /// Gradient of quadratic_x x^3 / 3 + quadratic_y y^3 / 3 + quadratic_xxy x^2 y + quadratic_xyy x y^2, N/m^2: springs
  /// stiffer to one side.
  double quadratic_x = 0, quadratic_y = 0, quadratic_xxy = 0, quadratic_xyy = 0;

  /// Per unit mass.
  rotor::FurtherForces<double> per_mass(double mass) const;
  static RigForces of(const rotor::FurtherForces<double>& per_mass, double mass);
};

/// Tilt of the disk axis: the gyroscopic rotor with four lateral degrees of freedom (whirl/rotor/gyroscopic.hpp), for a
/// disk that does not sit in the middle of its shaft. `RigRotor::stiffness` stays what a slow pull finds, the disk free
/// to tilt: k11 = K1 + k12^2 / k22. Default: none, the rotor of the paper.
struct RigTilt {
  double polar = 0;             ///< Ip, about the spin axis, kg m^2
  double diametral = 0;         ///< Id, about a diameter, kg m^2; 0 = no tilt
  double stiffness = 0;         ///< k22, N m/rad
  double coupling = 0;          ///< k12, N
  double damping_ratio = 0;     ///< c22 / (2 sqrt(k22 Id))
  double couple_unbalance = 0;  ///< chi, angle between disk axis and shaft, rad
  double couple_phase = 0;      ///< of chi, rad from the angle zero

  bool active() const { return diametral > 0; }
};

/// A linear mode of the structure beside the rotor's own, the same on both axes: excited by its initial
/// deflection (the e^{lambda t} terms of paper eq. 21), by the actuators and, when asked for, by the
/// unbalance; seen by the sensors, not part of the disk motion.
struct RigMode {
  double frequency = 0;  ///< undamped, Hz
  double damping_ratio = 0;
  double participation = 0;    ///< acceleration per newton relative to the rotor's 1/m
  double sensor_sign = 1;      ///< shape at the sensor
  double initial = 0;          ///< deflection at t = 0, m
  double unbalance_share = 0;  ///< acceleration by the unbalance relative to the rotor's eps F
};

/// Two laser displacement sensors, read by an analog-digital converter.
struct RigLaser {
  double noise = 0.7e-6;     ///< rms of one reading, m
  double range = 25e-3;      ///< full range, m: readings within +- range / 2; the converter spans it
  int bits = 16;             ///< converter resolution; 0 = none
  double rate = 4000;        ///< Hz; 0 = continuous
  double latency = 0.25e-3;  ///< age of the newest reading when it becomes available, s
  double bandwidth = 0;      ///< first-order low-pass of the sensor, Hz; 0 = not stated
  double hysteresis = 0;     ///< width of the play between displacement and reading, m; 0 = not stated
  double runout_1x = 12e-6;  ///< amplitude of the surface error once per turn, m
  double runout_2x = 5e-6;
  double runout_3x = 3e-6;
  double runout_phase_1x = 0.4;  ///< rad
  double runout_phase_2x = 1.3;
  double runout_phase_3x = 2.1;

  /// Age of a reading of slow motion: the low-pass is late by its time constant, s.
  double delay() const { return latency + (bandwidth > 0 ? 1 / (2 * std::numbers::pi * bandwidth) : 0); }
  bool operator==(const RigLaser&) const = default;
};

/// Two actuators with amplifier and digital-analog converter.
struct RigActuator {
  double voltage_limit = 10;                          ///< +- V
  int bits = 16;                                      ///< converter resolution; 0 = none
  double force_per_volt = 4;                          ///< amplifier gain times force constant the user assumes, N/V
  double gain_error = -0.04;                          ///< true gain / assumed gain - 1
  double axis_rotation = 2 * std::numbers::pi / 180;  ///< actuator axes against sensor axes, rad
  double bandwidth = 200;                             ///< first-order lag, Hz; 0 = none
  int delay_samples = 1;        ///< computation: a command acts this many ticks after its measurement
  int extra_delay_samples = 0;  ///< further delay, e.g. of a bus
  // Further limits of amplifier and actuator, as their data sheets state them; 0 = not stated.
  double current_limit = 0;     ///< of the amplifier, +- A
  double force_per_ampere = 0;  ///< force constant, N/A
  double slew = 0;              ///< fastest change of the force, N/s
  double hysteresis = 0;        ///< width of the play between asked and acting force, N
  /// The board turns what turns with the rotor in the force on by its own angle while no command comes.
  bool turns_held_force = false;

  /// The smaller of what voltage and current allow, N.
  double force_limit() const {
    const double by_voltage = voltage_limit * force_per_volt, by_current = current_limit * force_per_ampere;
    return by_current > 0 && by_current < by_voltage ? by_current : by_voltage;
  }
};

/// Incremental encoder with a tracking loop for speed and acceleration.
struct RigEncoder {
  int counts = 1024;           ///< per turn; 0 = exact angle, speed and acceleration
  double bandwidth = 5;        ///< of the tracking loop, Hz
  bool profile_angle = false;  ///< true: no encoder; angle computed from the commanded profile (without ripple)

  bool operator==(const RigEncoder&) const = default;
};

struct RigTiming {
  double rate = 1000;  ///< control ticks per second, Hz
  int substeps = 4;    ///< Runge-Kutta steps per tick; must hold every sensor instant

  bool operator==(const RigTiming&) const = default;
};

/// Everything that defines the virtual rig. SI, plain aggregate; defaults reproduce the paper's open-loop
/// levels, read as zero-to-peak (balanced 1.242 mm, Table 4 for 5 g). Not unique: many plausible rigs fit
/// (docs: rig README).
struct RigParameters {
  RigRotor rotor;
  rotor::SpeedProfile profile = default_profile();
  std::vector<RigMode> modes = default_modes();
  RigLaser laser;
  RigActuator actuator;
  RigEncoder encoder;
  RigTiming timing;
  RigTilt tilt;
  RigForces forces;

  /// 2.5 w1 -> 0 in 13 s with 0.4 % speed ripple, then 1 s at standstill.
  static rotor::SpeedProfile default_profile();
  static std::vector<RigMode> default_modes();
  /// Identification tests: isotropic rotor, no modes, exact sensors and actuators. A: 12 Hz, zeta 2 %, 30 ->
  /// 0 Hz in 12 s, 5 g added. B: 15 Hz, C/m = 7.5 1/s, 40 -> 0 Hz in 15 s, no added mass.
  static RigParameters ideal_rotor_a();
  static RigParameters ideal_rotor_b();

  double natural_frequency() const;           ///< sqrt(K1 / m), with tilt the first forward critical speed, rad/s
  std::complex<double> eccentricity() const;  ///< residual + added, m, in the rotor frame
  /// The true lateral equations without tilt and further forces, with the actuator gain 1/m, and the modes that the
  /// unbalance drives as the sensors see them.
  RotorModel true_model() const;
  /// The same record in the other direction: profile reversed in time.
  RigParameters run_up() const;
  /// Throws Error naming the first field out of range, or a sensor instant that no substep hits.
  void check() const;
};

enum class RigFault : std::uint8_t {
  sensor_loss,    ///< laser signal at full scale, Measurement::valid = false
  sensor_stuck,   ///< laser repeats its last reading, valid = true
  extra_delay,    ///< commands act `delay_samples` ticks later
  actuator_loss,  ///< no force on the axis (of the actuator)
  encoder_stuck,  ///< angle, speed and acceleration repeat their last values
  encoder_slip,   ///< the measured angle is off by `angle`
  unbalance,      ///< the eccentricity of the disk times `factor`: mass lost, added or turned
};
enum class RigAxis : std::uint8_t { both, x, y };

/// One event of a fault script, active for start <= t < end.
struct ScriptedFault {
  RigFault kind = RigFault::sensor_loss;
  double start = 0, end = 0;  ///< s
  RigAxis axis = RigAxis::both;
  int delay_samples = 0;            ///< for extra_delay
  double angle = 0;                 ///< for encoder_slip, rad
  std::complex<double> factor = 1;  ///< for unbalance
};

/// One experiment on the rig.
struct RigRun {
  std::uint64_t seed = 1;
  std::vector<ScriptedFault> faults = {};
};

}  // namespace whirl::rig
