#pragma once
#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/angle_signal.hpp"
#include "whirl/core/quantity.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::identification {

/// Which directions a record shows. Of one direction the other is taken to be that of an isotropic rotor.
enum class Axes { both, x, y };

struct RotorRecordOptions {
  std::string x = "x", y = "y";  ///< channels of one quantity: displacement, or see any_motion
  bool one_axis = false;         ///< a record may lack one of them: see RotorRecord::axes
  bool any_motion = false;       ///< velocity and acceleration too: see RotorRecord::quantity
  std::string angle = "beta";    ///< encoder angle channel, rad; unused when `known_angle` is set
  signal::AngleFitOptions angle_fit;
  std::optional<AngleSignal> known_angle;  ///< angle from pulses or a profile, same samples as the record
  /// Known age of the displacement samples against the angle (sensor and filter latency), s; negative: the angle is
  /// older.
  double sensor_delay = 0;
  double noise_sd = 0;  ///< displacement noise per axis, m rms, white; 0: size and colour are estimated
  /// records::check before anything is fitted: samples that are clipped, frozen, missing or far off are left out, hum
  /// and drift are estimated beside the motion, a record that cannot be used is refused. Without it the samples must be
  /// finite.
  bool check = true;
};

/// An axis cut off by its measuring range. A reading at a limit says that the displacement lies there or beyond.
struct Clipped {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();  ///< m
  Eigen::VectorXd readings;  ///< as recorded, m
  Eigen::ArrayXd sound;      ///< 1: a reading between the limits, or at one of them; 0: left out
};

/// One run-up or run-down as identification needs it: z = x + i y with the rotor angle and the noise.
struct RotorRecord {
  std::string source;
  double dt = 0;       ///< s
  double t0 = 0;       ///< time of the first sample, s
  Eigen::VectorXcd z;  ///< x + i y, SI unit of `quantity`
  /// Of x and y: displacement, velocity or acceleration. Noise, limits and offset have its unit too.
  Quantity quantity = Quantity::displacement;
  AngleSignal angle;  ///< when the readings were taken
  /// Step of the angle readings, rad, where nothing says how they are rounded (angle_fit.count_offset 0): the phase of
  /// e is known to half a step.
  double angle_step = 0;
  double noise_x = 0, noise_y = 0;  ///< sd of the noise per axis, m; of an axis that is not measured that of the other
  /// Autoregression of the noise, n_i = sum_k colour_k n_{i-1-k} + e_i, the same for both axes; empty: white.
  Eigen::VectorXd colour = {};
  /// 1, or 0 for a sample that is left out and bridged in z; both empty: all are usable.
  Eigen::ArrayXd usable_x = {}, usable_y = {};
  std::optional<Clipped> clipped_x = {}, clipped_y = {};  ///< usable_ leaves out what lies near their limits too
  /// The axes measured. Of one that is not, usable_ is 0 and z holds what the analytic signal of the other gives.
  Axes axes = Axes::both;
  std::vector<double> hum = {};  ///< mains lines estimated beside the motion, Hz
  bool drift = false;            ///< a slow drift is estimated beside the motion
  /// Unusable, with the reason, when no rotor can be identified from this record: fewer than 1000 samples or 5
  /// turns, a constant or vanishing displacement channel, x and y the same signal, a speed that hardly changes,
  /// fewer than 8 samples per turn at the top speed, or noise larger than the signal.
  Summary summary;

  Eigen::Index size() const { return z.size(); }
  /// Of the displacement that x and y are: 1 velocity, 2 acceleration.
  int derivative() const { return quantity == Quantity::velocity ? 1 : quantity == Quantity::acceleration ? 2 : 0; }
  double turns() const;       ///< revolutions turned
  double speed_low() const;   ///< smallest |speed|, rad/s
  double speed_high() const;  ///< largest |speed|, rad/s
  bool one_axis() const { return axes != Axes::both; }
  /// Of z, m^2. One axis says half as much of a forward whirl as two do: its noise counts twice.
  double noise_variance() const { return (one_axis() ? 2 : 1) * (noise_x * noise_x + noise_y * noise_y); }
  double noise_sd() const;  ///< of the axes measured, m rms
  double readings() const { return (one_axis() ? 1.0 : 2.0) * static_cast<double>(size()); }  ///< real numbers
  /// Spectral density of the noise at an angular frequency over that of its innovations; 1 when white.
  double noise_gain(double omega) const;
  double noise_power() const;  ///< mean of noise_gain over all frequencies: variance of the noise over its innovations
};

/// Findings of the record check stand in the summary: with a warning where samples are left out or something is
/// estimated beside the motion, unusable where the record is refused. Throws Error for missing channels, wrong
/// quantities, an angle that is not finite or a known angle of another length.
RotorRecord rotor_record(const Recording& recording, const RotorRecordOptions& options = {});

}  // namespace whirl::identification
