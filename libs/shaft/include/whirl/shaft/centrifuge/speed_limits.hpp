#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/shaft/centrifuge/load_check.hpp"

namespace whirl::shaft {

/// Where to trip: amplitude (zero-to-peak) of each sensor over speed, of machines within the tolerances.
struct SpeedLimits {
  std::vector<CentrifugeSensor> sensors;
  std::vector<double> speeds;  ///< rad/s
  Eigen::MatrixXd expected;    ///< sensors x speeds: median with the allowed imbalance, m/s^2 or m
  Eigen::MatrixXd trip;        ///< what 99 of 100 machines stay below with `safety` times the allowed imbalance
  /// Mass at the buckets' radius at which the first sensor trips in 99 of 100 machines, kg.
  Eigen::VectorXd caught;
  std::vector<double> criticals;  ///< forward, rad/s
};
/// From the steady response to an imbalance at the buckets: a passage with acceleration stays below it. Throws Error
/// without [centrifuge] or sensors, and for a safety below 1.
SpeedLimits speed_limits(const Rotor& rotor, const CentrifugeSetup& setup, const std::vector<double>& speeds,
                         double safety = 2, int draws = 300, unsigned seed = 1);

}  // namespace whirl::shaft
