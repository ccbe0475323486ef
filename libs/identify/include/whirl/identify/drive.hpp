#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/simulate_model.hpp"

namespace whirl::identification {

struct DriveOptions {
  /// Of the lateral motion that the fit starts from. Drive fits are made with these channels.
  RotorIdentifyOptions rotor = {};
  /// Channel of the drive: voltage, or share of the full one; 0 while the motor is off. Records without it coast.
  std::string drive = "drive";
  double inertia = 0;  ///< J_bar about the centre of mass, kg m^2; 0: not known, torques stay per inertia
  double mass = 0;     ///< of the disk, kg; 0: not known
};

/// All six states of the paper (eqs. 21, 23, with the corrections of docs/paper-errata.md) from records of run-ups
/// under a drive signal u and of coast-downs:
///
///   X6' = motor u - motor_slope [u not 0] X6 - coulomb sgn X6 - viscous X6 - drag X6 |X6|
///         + mass_per_inertia e (F_y cos b - F_x sin b),   b = X5 + e_phase, F = k1 d + k2 |d|^2 d + c d'
///   X2' = -F_x + e (X6^2 cos b + X6' sin b),  X4' = -F_y + e (X6^2 sin b - X6' cos b)
///
/// motor = C_m1/J_bar (per unit of the drive, eq. 11), motor_slope = C_m2/J_bar, coulomb = C_c/J_bar, viscous =
/// C_v/J_bar, drag = C_a/J_bar, mass_per_inertia = m/J_bar, 1/m^2. The last bracket is what the shaking rotor takes
/// from the drive: it makes run-ups stall below the critical speed (Sommerfeld 1902).
///
/// Start from identify_rotor and from the angle's acceleration; then all constants together on free runs of all six
/// states, from a quarter of a second to the whole record (multiple shooting). What the records cannot tell apart is
/// joined and said: without a stretch with the motor off motor_slope is part of viscous, with one level of the drive
/// alone coulomb is part of motor. All records have one unbalance. With `inertia` the parameters C_m1, C_m2, C_c (N m),
/// C_v (N m s), C_a (N m s^2) follow; with `mass` too the bracket's factor is given.
///
/// The model's `rotor` is set; its input is the drive. Throws Error for missing channels.
IdentifiedModel identify_drive(const std::vector<Recording>& records, const DriveOptions& options = {});

/// Has the model an equation of the rotor's speed?
bool has_drive(const IdentifiedModel& model);

/// Free run of all six states over a record with the drive (none: coasting), from its first sample where it has x, y
/// and beta (their start fitted over the first turns), from rest otherwise. Channels x, y, beta and the drive.
Recording simulate_drive(const IdentifiedModel& model, const Recording& record);

/// A run from rest at a constant drive.
struct RunUp {
  Eigen::VectorXd time;    ///< s
  Eigen::VectorXd speed;   ///< rad/s
  Eigen::VectorXd radius;  ///< of the disk centre, m
  double reached = 0;      ///< mean speed over the last tenth, rad/s
};
RunUp run_up(const IdentifiedModel& model, double drive, double seconds, double rate);

/// Least constant drive with which a run from rest passes `speed` (rad/s) within `seconds`, to a share of 1e-4; NaN
/// when `most` does not do. Below it the run-up stalls.
double limiting_drive(const IdentifiedModel& model, double speed, double seconds, double rate, double most);

}  // namespace whirl::identification
