#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

/// Rotor with actuators and probes from sample to sample, forces held: x <- a x + b u, y = c x. The states are
/// (s q_x, s q_y, v_x, v_y) of modal coordinates q, s their frequencies, so that |x|^2 is twice the energy; then the
/// forces of the actuators that follow late, each as the speed that it gives the modes in its time constant.
struct SampledPlant {
  Eigen::MatrixXd a, b, c;
  Eigen::Index motion = 0;  ///< states before those forces
  double push = 0;          ///< largest acceleration by a newton, within a sample, 1/kg of the modes
};

/// The same at every speed, in coordinates that do not depend on speed.
class PlantFamily {
 public:
  /// `modes` of a plane, those of lowest frequency; 0: all.
  PlantFamily(const Rotor& rotor, const System& full, int modes);
  SampledPlant at(double speed, double sample_time) const;
  /// Damping that turns with the shaft, times a factor.
  void scale_rotating(double factor) { system_.rotating *= factor; }
  /// Readings of the unbalance and bow without control, Y of Re(Y e^{i theta}), m.
  Eigen::VectorXcd unbalance_readings(double speed) const;
  /// Poles without control, 1/s.
  Eigen::VectorXcd poles(double speed) const;
  const System& system() const { return system_; }

 private:
  std::pair<Eigen::MatrixXd, Eigen::MatrixXd> continuous(double speed) const;  // of (x, u)

  System system_;
  Eigen::VectorXd scale_;
  Eigen::MatrixXd push_, read_;                        // on (q_x, q_y)
  std::vector<std::pair<Eigen::Index, double>> late_;  // actuators that follow late, their bandwidth, rad/s
};

}  // namespace whirl::shaft
