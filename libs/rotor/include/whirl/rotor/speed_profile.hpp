#pragma once
#include <Eigen/Core>

#include "whirl/core/angle_signal.hpp"

namespace whirl::rotor {

/// Rotor angle and its derivatives at one instant.
struct AngleState {
  double beta = 0;   ///< rad, continuous
  double omega = 0;  ///< rad/s
  double alpha = 0;  ///< rad/s^2
};

/// Prescribed rotor speed: dwell, linear ramp, dwell, with an optional ripple of the speed loop,
///
///   omega(t) = omega_ramp(t) (1 + ripple sin(ripple_omega t + ripple_phase)).
///
/// The paper's speed controller holds beta'' constant (section VI); the ripple is its imperfection. The angle
/// is the exact integral, not a quadrature. beta'' jumps at the two ends of the ramp: let them fall on
/// samples.
struct SpeedProfile {
  double omega_start = 0;   ///< speed before the ramp, rad/s
  double omega_end = 0;     ///< speed after the ramp, rad/s
  double dwell_start = 0;   ///< time at omega_start, s, >= 0
  double ramp_time = 1;     ///< s, > 0
  double dwell_end = 0;     ///< time at omega_end, s, >= 0 (standstill after a run-down)
  double ripple = 0;        ///< relative amplitude of the speed ripple
  double ripple_omega = 0;  ///< rad/s; > 0 when ripple is not 0
  double ripple_phase = 0;  ///< rad
  double beta_start = 0;    ///< angle at t = 0, rad

  double duration() const { return dwell_start + ramp_time + dwell_end; }
  /// Angle at time t; before 0 and after the end the dwell speeds continue.
  AngleState at(double t) const;
  /// The same machine without speed ripple: what a controller computes when it knows the command only.
  SpeedProfile without_ripple() const;
  /// Throws Error when a field is outside its range.
  void check() const;

  bool operator==(const SpeedProfile&) const = default;

  static SpeedProfile run_down(double omega, double ramp_time, double standstill = 0);
  static SpeedProfile run_up(double omega, double ramp_time, double dwell = 0);
};

/// SpeedProfile::at for many instants: the constants of the pieces are computed once.
class AngleFunction {
 public:
  explicit AngleFunction(const SpeedProfile& profile);
  AngleState operator()(double t) const;

 private:
  /// omega_ramp = speed + slope (t - start) from `start` on; angle = offset + smooth part + ripple integral.
  struct Piece {
    double start, speed, slope, offset;
  };
  Piece pieces_[3];
  double ripple_, ripple_omega_, ripple_phase_;
};

/// Samples 0, dt, 2 dt, ... of the profile with the true midpoints. `samples` = 0: the whole duration,
/// round(duration / dt) samples.
AngleSignal angle_signal(const SpeedProfile& profile, double dt, Eigen::Index samples = 0);

/// Driving and friction torque, paper eqs. 6 to 11 (eq. 8 with beta'; docs/paper-errata.md):
///
///   tau = C_m1 - C_m2 beta' - C_c sgn(beta') - C_v beta' - C_a beta' |beta'|
///
/// At rest the Coulomb torque holds the rotor as long as |C_m1| <= C_c. Coast-down: motor = motor_slope = 0.
struct TorqueModel {
  double motor = 0;        ///< C_m1 = K_t V / R, N m
  double motor_slope = 0;  ///< C_m2 = K_t K_b / R, N m s
  double coulomb = 0;      ///< C_c, N m
  double viscous = 0;      ///< C_v, N m s
  double drag = 0;         ///< C_a, N m s^2

  double torque(double omega) const;  ///< N m
};

}  // namespace whirl::rotor
