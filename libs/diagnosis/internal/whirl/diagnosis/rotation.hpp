#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/signal/synchronous_curve.hpp"

namespace whirl::diagnosis {

/// The part of a record in which the shaft turns, with its angle and speed per sample.
struct Rotation {
  Eigen::Index first = 0;  ///< sample of the record at which the part begins
  Eigen::VectorXd angle;   ///< rad, rising
  Eigen::VectorXd speed;   ///< rad/s
  double resolution = 0;   ///< smallest step seen in the readings, rad; 0 when they are not quantised

  Eigen::Index size() const { return angle.size(); }
  double highest_speed() const { return speed.size() > 0 ? speed.maxCoeff() : 0; }  ///< rad/s
  /// Largest rate of change of the speed over a twentieth of the part, rad/s^2.
  double sweep_rate(double dt) const;
};

/// From the channel "beta" (encoder, wrapped or continuous), else from a tacho or a speed (signal::angle_of_tacho).
/// Nothing when the record has none of them, or the shaft does not turn twice. Standstill (below 2 % of the highest
/// speed) at the begin and end is left out. Throws Error when the shaft turns backwards: the angle must rise.
std::optional<Rotation> rotation_of(const Recording& record);

/// Straight lines over missing readings (NaN); the nearest one before the first and after the last.
Eigen::VectorXd gaps_bridged(Eigen::VectorXd samples);

/// 1X vectors (or another order) of one channel, one per `turns` revolutions, with the slow-roll vector taken off: the
/// mean of the vectors below `slow_roll` (rad/s; 0: nothing is taken off). Turns with missing readings (NaN) have no
/// vector. Throws Error when no revolution is slower or none has all of its readings.
signal::SynchronousCurve order_curve(const Recording& record, const Rotation& rotation, const std::string& channel,
                                     double order = 1, int turns = 1, double slow_roll = 0);

}  // namespace whirl::diagnosis
