#pragma once
#include <optional>
#include <vector>

#include "whirl/response/synchronous.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::response {

/// What an infinitely slow run meets: at every speed the stable answer that continues the one before; where it ends in
/// a fold the run jumps to the one that is left. `from` > `to` is a run-down. Of the isotropic part of the rotor.
struct SlowRun {
  std::vector<SynchronousPoint> points;  ///< in the order of the run
  std::vector<std::size_t> jumps;        ///< index of the first point after a jump
  double peak = 0;                       ///< largest radius, m
  double peak_speed = 0;                 ///< rad/s
};
SlowRun slow_run(const RotorModel& rotor, double from, double to, int steps = 4000);

/// A run through a range of speeds at constant angular acceleration, from the steady whirl at its first speed.
struct Passage {
  double rate = 0;        ///< |d Omega / dt|, rad/s^2
  double peak = 0;        ///< largest radius of the main mode, m
  double peak_speed = 0;  ///< there, rad/s
  double reaction = 0;    ///< largest torque that the whirl takes, mean over a turn, N m per kg of the rotor
};
/// Runge-Kutta of order 4 with 60 steps a turn of the fastest motion. After the ramp the speed is held for a time
/// 4 / c at most, so that a peak behind the end of a fast ramp is seen. Throws Error for a rate <= 0 or speeds < 0.
Passage passage(const RotorModel& rotor, double from, double to, double rate);

struct RunUpOptions {
  double from = 0, to = 0;          ///< rad/s; the run-down goes back from `to` to `from`
  double limit = 0;                 ///< largest radius allowed, m; 0: none
  double slowest = 0, fastest = 0;  ///< rates looked at, rad/s^2; 0: from almost steady to two turns of the rotor
  int rates = 25;                   ///< equal steps of the logarithm
};

/// Peak over rate, one direction.
struct RateCurve {
  std::vector<Passage> passages;  ///< rates ascending
  double slow_peak = 0;           ///< of slow_run()
  /// At this and every faster rate looked at the peak stays within the limit; nothing when no rate does. Equal to the
  /// slowest rate when all do.
  std::optional<double> slowest_safe;
  /// Faster is of no use: the peak is within 5 % of what the end of the range has anyway, or of the fastest rate.
  double fastest_useful = 0;
  /// Largest |d log peak / d log rate|, and where: above 1 small changes of the rate decide whether the run follows the
  /// upper branch (a linear rotor stays below 0.5).
  double sensitivity = 0, sensitive_rate = 0;
};
struct RunUpPlan {
  RateCurve up, down;
};
/// Throws Error for an empty range, a limit < 0 or rates that do not ascend.
RunUpPlan plan_run_up(const RotorModel& rotor, const RunUpOptions& options);

/// Peak of one passage over the covariance of (k1, k2, c, eps_re, eps_im): 2.5 and 97.5 % quantiles of `draws` rotors.
struct PeakBand {
  double low = 0, high = 0;  ///< m
};
PeakBand passage_band(const RotorModel& rotor, const std::vector<double>& covariance, double from, double to,
                      double rate, int draws = 100, unsigned seed = 1);

/// Torque that a whirling rotor takes from its drive at a steady answer: the power of the damping over the speed,
/// m c Omega radius^2, N m.
double whirl_torque(const RotorModel& rotor, double mass, const SynchronousPoint& answer);

/// Smallest constant motor torque by which a slow run-up comes through: the largest of whirl torque and friction along
/// slow_run() (Sommerfeld effect: with less, the drive's power goes into the whirl and the speed stands still below the
/// critical speed). N m. `friction`: its motor terms are not used.
struct StallLimit {
  double torque = 0;  ///< N m
  double speed = 0;   ///< where the drive stalls with less, rad/s
};
StallLimit stall_limit(const RotorModel& rotor, double mass, const rotor::TorqueModel& friction, double from,
                       double to);

/// A run-up by a drive of given torque, angle and whirl coupled both ways (paper eqs. 2 to 11).
struct DrivenRunUp {
  bool reached = false;    ///< the speed `to`
  double seconds = 0;      ///< until then, or until it was given up
  double final_speed = 0;  ///< rad/s
  double peak = 0;         ///< m
  double peak_speed = 0;   ///< rad/s
};
/// `inertia` of the rotor about its centre of mass, kg m^2; the isotropic part of the rotor. Ends at `to`, or at
/// `longest` seconds. Throws Error for values <= 0.
DrivenRunUp driven_run_up(const RotorModel& rotor, double mass, double inertia, const rotor::TorqueModel& torque,
                          double from, double to, double longest);

}  // namespace whirl::response
