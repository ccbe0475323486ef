#pragma once
#include <Eigen/Core>
#include <vector>

#include "control/sampled_plant.hpp"
#include "whirl/shaft/control/controller.hpp"

namespace whirl::shaft {

/// What differs from the plant that a controller was designed for.
struct LoopChange {
  double gain = 1;          ///< of all actuators
  int delay = 0;            ///< samples more
  bool synchronous = true;  ///< the turning part acts
};

/// What a loop answers at one frequency.
struct LineResponse {
  Eigen::MatrixXcd influence, output_sensitivity;  ///< readings per newton added to commands, per metre to readings
  Eigen::MatrixXcd of_commands, of_readings;       ///< forces per newton added to commands, per metre to readings
};

/// Plant and controller at one speed, as x <- matrix x. States: plant, controller, forces (those on their way last),
/// turning part.
class ClosedLoop {
 public:
  ClosedLoop(const SampledPlant& plant, const RotorController& controller, double speed, const LoopChange& change = {});
  const Eigen::MatrixXd& matrix() const { return matrix_; }
  /// Largest growth rate, 1/s; positive: unstable.
  double growth() const;
  /// Whether it is negative, most often told by powers of the matrix alone.
  bool decays() const;
  /// The sign of it alone, by powers of the matrix: for large ones. Growth below 1e-3 1/s passes.
  bool stable() const;
  /// Poles as of continuous time, 1/s, those with an imaginary part >= 0.
  std::vector<std::complex<double>> poles() const;
  /// At `frequency` (rad/s).
  LineResponse line(double frequency) const;
  /// Of each actuator with the loops of all others closed: what acts per what is added there (ISO 14839-3).
  Eigen::VectorXd sensitivity(double frequency) const;
  /// Rms of each force per rms of white noise of every probe, N/m.
  Eigen::VectorXd force_noise() const;
  /// Largest over frequency up to half the sample rate.
  Eigen::VectorXd sensitivity_peak() const;

 private:
  Eigen::MatrixXcd respond(double frequency, const Eigen::MatrixXd& input) const;
  const Eigen::VectorXcd& eigenvalues() const;

  Eigen::MatrixXd matrix_, read_, command_, disturb_, push_;
  mutable Eigen::VectorXcd eigenvalues_;  ///< empty until asked for
  Eigen::Index force_at_ = 0;
  double step_ = 0;
};

}  // namespace whirl::shaft
