#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>

#include "whirl/core/angle_signal.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::identification {

struct RotorRecordOptions {
  std::string x = "x", y = "y";  ///< displacement channels, m
  std::string angle = "beta";    ///< encoder angle channel, rad; unused when `known_angle` is set
  signal::AngleFitOptions angle_fit;
  std::optional<AngleSignal> known_angle;  ///< angle from pulses or a profile, same samples as the record
  /// Known age of the displacement samples against the angle (sensor and filter latency), s; negative: the angle is
  /// older.
  double sensor_delay = 0;
  double noise_sd = 0;  ///< displacement noise per axis, m rms; 0: estimated from sixth differences
};

/// One run-up or run-down as identification needs it: z = x + i y with the rotor angle and the noise.
struct RotorRecord {
  std::string source;
  double dt = 0;                    ///< s
  Eigen::VectorXcd z;               ///< x + i y, m
  AngleSignal angle;                ///< when the displacement was taken
  double noise_x = 0, noise_y = 0;  ///< sd of the white noise per axis, m
  /// Unusable, with the reason, when no rotor can be identified from this record: fewer than 1000 samples or 5
  /// turns, a constant or vanishing displacement channel, x and y the same signal, a speed that hardly changes,
  /// fewer than 8 samples per turn at the top speed, or noise larger than the signal.
  Summary summary;

  Eigen::Index size() const { return z.size(); }
  double turns() const;                                                            ///< revolutions turned
  double speed_low() const;                                                        ///< smallest |speed|, rad/s
  double speed_high() const;                                                       ///< largest |speed|, rad/s
  double noise_variance() const { return noise_x * noise_x + noise_y * noise_y; }  ///< of z, m^2
};

/// Throws Error for missing channels, wrong quantities, samples that are not finite or a known angle of another length.
RotorRecord rotor_record(const Recording& recording, const RotorRecordOptions& options = {});

}  // namespace whirl::identification
