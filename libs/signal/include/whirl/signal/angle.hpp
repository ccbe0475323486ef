#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/angle_signal.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/signal/tacho_pattern.hpp"

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
  long missing = 0, extra = 0;  ///< pulses of a tacho found missing or rejected
  TachoPattern pattern;         ///< of the tacho
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

/// Angle from the pulses of a tacho at the times given (s, ascending), on `samples` samples from t = 0. How many marks
/// pass in a turn and where they stand is learned from the times unless `tacho` states it; evenly spaced pulses that do
/// not tell are taken as one a turn (`pattern.assumed`). The angle is a whole turn at the first mark: the pulse after
/// the longest gap, of even pulses the first one. Pulses that the speed up to there does not expect are extra, marks
/// without one missing. Before the first and after the last pulse the fit is continued. `quantum`: steps of the times,
/// s; 0: exact. Throws Error for fewer than 6 pulses or without a pattern that holds, saying what was seen.
AngleFit angle_from_pulses(const std::vector<double>& times, double dt, Eigen::Index samples,
                           const AngleFitOptions& options = {}, const TachoOptions& tacho = {}, double quantum = 0);

/// Known profile: beta = beta0 + omega0 t + alpha t^2 / 2.
AngleSignal angle_from_profile(double beta0, double omega0, double alpha, double dt, Eigen::Index samples);

}  // namespace whirl::signal
