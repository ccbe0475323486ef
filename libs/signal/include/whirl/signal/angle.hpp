#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/angle_signal.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"

namespace whirl::signal {

/// How a smooth angle is fitted: a quintic spline with equal intervals (one interval: a polynomial).
struct AngleFitOptions {
  /// Spline intervals; 0 chooses from polynomials of degree 2 to 5 and splines of 2, 4, 8, ... intervals by BIC.
  int intervals = 0;
  /// Shortest spline interval tried, s. A speed-loop ripple needs about a third of its period.
  double shortest_interval = 0.08;
  /// Readings before the fit are shifted by this many counts (encoder only). A counter that rounds down lags by half a
  /// count on average: 0.5. An encoder channel already in rounded angle: 0.
  double count_offset = 0;
};

/// A smooth angle with what its fit says.
struct AngleFit {
  AngleSignal angle;
  double residual = 0;          ///< rms of readings minus fit, rad
  double resolution = 0;        ///< smallest step seen in the readings, rad; 0 when they are not quantised
  int parameters = 0;           ///< of the chosen spline
  long missing = 0, extra = 0;  ///< once-per-turn pulses found missing or rejected
  Summary summary;              ///< warnings, e.g. a residual much above the resolution
};

/// Angle readings without wraps: every step the one nearest to none, modulo a turn. A reading taken in the middle of a
/// wrap (a filter or a resampling smears the jump over a sample) becomes the mean of its neighbours.
Eigen::VectorXd unwrapped(const Eigen::Ref<const Eigen::VectorXd>& readings);

/// Angle with rate and acceleration from an encoder channel, rad, one reading per sample, wrapped to any period of 2 pi
/// or continuous, quantised or not. Jumps beyond half a turn between samples are taken as wraps, so the speed must stay
/// below half a turn per sample. Throws Error for fewer than 16 readings or non-finite ones.
AngleFit angle_from_encoder(const Eigen::Ref<const Eigen::VectorXd>& readings, double dt,
                            const AngleFitOptions& options = {});

/// Rising edges of a keyphasor signal: times (s, sample 0 at t = 0) of the crossings of the middle level, interpolated
/// linearly. An edge counts only after the signal was below `low` of its range (hysteresis); its range leaves out the
/// three largest and smallest samples.
std::vector<double> pulse_times(const Eigen::Ref<const Eigen::VectorXd>& signal, double dt, double low = 0.3,
                                double middle = 0.5);

/// The channel of once-per-turn pulses by its name: key, keyphasor or tacho; null where there is none.
const Channel* pulse_channel(const Recording& record);

/// Angle from once-per-turn pulses at the times given (s, ascending), on `samples` samples from t = 0; the angle is 0
/// at the first pulse. Turns are counted outwards from the longest stretch of even periods; pulses that the speed up to
/// there does not expect are extra, turns without one missing. Before the first and after the last pulse the fit is
/// continued. Throws Error for fewer than 6 pulses or none that are even.
AngleFit angle_from_pulses(const std::vector<double>& times, double dt, Eigen::Index samples,
                           const AngleFitOptions& options = {});

/// Known profile: beta = beta0 + omega0 t + alpha t^2 / 2.
AngleSignal angle_from_profile(double beta0, double omega0, double alpha, double dt, Eigen::Index samples);

}  // namespace whirl::signal
