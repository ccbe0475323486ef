#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

/// Forces of a sampled controller: what follows from the readings at one sample acts from the next one to that after
/// it.
struct SampledForces {
  using Step = std::function<Eigen::VectorXd(const Eigen::VectorXd& readings, double angle, double speed)>;
  double period = 0;            ///< s
  Eigen::MatrixXd columns;      ///< force on (q_x, q_y) per newton
  Eigen::VectorXd bandwidth;    ///< with which each force follows, rad/s; 0 (or empty): at once
  Eigen::MatrixXd rows;         ///< readings of (q_x, q_y)
  std::function<Step()> start;  ///< makes a controller at rest; none: no forces
};

/// A run at constant angular acceleration.
struct RunOptions {
  double from = 0, to = 0;    ///< speeds, rad/s
  double duration = 0;        ///< s
  double sample_time = 1e-3;  ///< of the result, s
  bool from_rest = false;     ///< begin undeflected and without motion instead of in the steady response
  bool weight = false;        ///< gravity acts (of a rotor that is not vertical)
  /// The step is halved until the estimate of its error is below this part of the largest deflection.
  double tolerance = 1e-4;
  SampledForces control = {};  ///< its period divides the sample time
};

/// Motion of every station. Step of the integration: collocation at the two Gauss points, order 4, stable for any step
/// (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, 1993, sec. II.7); the gyroscopic matrix is
/// that of the middle of a step. An undamped frequency w is low by (w h)^4 / 720 of itself, where Newmark's mean
/// acceleration loses (w h)^2 / 12: 2.7 % of a resonance peak at 45 Hz and 1 ms.
struct RotorRun {
  Eigen::VectorXd time, speed, angle;  ///< s, rad/s, rad
  Eigen::MatrixXd x, y;                ///< nodes x samples, m
  Eigen::MatrixXd body_x, body_y;      ///< bodies x samples, m
  Eigen::MatrixXd forces;              ///< actuators x samples, as they acted until the sample, N
  double step = 0;                     ///< of the integration, s
  /// Estimate of the error of the time steps: of the change against steps twice as long a 15th, four times a 255th, as
  /// a part of the largest deflection.
  double step_error = 0;
};
/// Throws Error for a duration or sample time that is not positive or a negative speed.
RotorRun simulate_run(const System& system, const RunOptions& options);

/// Largest distance from the line of bearings, sqrt(x^2 + y^2).
struct RunPeak {
  double size = 0, speed = 0, time = 0;  ///< m, rad/s, s
};
RunPeak run_peak(const RotorRun& run, Eigen::Index node);

}  // namespace whirl::shaft
