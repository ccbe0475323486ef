#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

/// Feedback at one speed. At sample k, with the readings y and the forces a that act until sample k + 1,
///     z <- advance z + readings y + forces a,    u = -feedback z,
/// and u acts from sample k + 1 to sample k + 2.
struct ControlGains {
  double speed = 0;  ///< rad/s
  Eigen::MatrixXd advance, readings, forces, feedback;
};

/// The part that turns with the shaft, at one speed: the force vectors V of u + Re(V e^{i theta}), theta the angle at
/// the sample. V begins at `start`; the readings Y and forces F that turn with the shaft move it by
/// -`correction` Y - `relief` F. It rests where the sum of |Y|^2 and the weighted |F|^2 is least.
struct SynchronousGains {
  double speed = 0;             ///< rad/s
  Eigen::MatrixXcd correction;  ///< inverse of the closed loop's influence, N/m
  Eigen::MatrixXcd relief;      ///< the same of the forces, by their weight
  Eigen::VectorXcd start;       ///< against the unbalance of the model, N
  Eigen::VectorXd most;         ///< size of V, N: with it the force stays within its share of the limit
};

/// Controller of all actuators from all probes, in discrete time. Matrices are linear between the speeds, held beyond.
struct RotorController {
  double sample_time = 0;  ///< s
  std::vector<Probe> probes;
  std::vector<Actuator> actuators;
  std::vector<ControlGains> gains;            ///< by speed, ascending
  std::vector<SynchronousGains> synchronous;  ///< by speed, ascending
  double adaptation = 0;                      ///< of the turning part, 1/s

  Eigen::Index states() const { return gains.empty() ? 0 : gains.front().advance.rows(); }
  ControlGains at(double speed) const;
  SynchronousGains synchronous_at(double speed) const;
};

/// Throws Error where sizes or speeds do not fit together.
void check(const RotorController& controller);

void save_rotor_controller(const std::filesystem::path& file, const RotorController& controller);
/// Throws Error with file, place and what is allowed.
RotorController load_rotor_controller(const std::filesystem::path& file);

/// What is added to speed^2 where the turning part is kept as a force per speed^2, (rad/s)^2.
double turning_floor(const RotorController& controller);

/// One step of a controller after another.
class RotorControl {
 public:
  explicit RotorControl(RotorController controller);
  /// Forces that act from the next sample on, N: limited in size and in rate. Readings in m, with the runout of the
  /// probes, which is taken away.
  const Eigen::VectorXd& step(const Eigen::VectorXd& readings, double angle, double speed);

 private:
  void turn(const Eigen::VectorXd& readings, double angle, double speed);

  RotorController c_;
  Eigen::VectorXd state_, force_, wanted_;
  Eigen::VectorXcd adapted_, vector_;  // kg m, N
  double slow_ = 0;                    // (rad/s)^2
};

}  // namespace whirl::shaft
