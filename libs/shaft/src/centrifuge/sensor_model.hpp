#pragma once
#include <Eigen/Core>
#include <random>
#include <vector>

#include "whirl/shaft/centrifuge/load_check.hpp"
#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

/// A machine within the tolerances.
struct CentrifugeDraw {
  double stiffness = 1, damping = 1;         ///< factors of the mounts
  double load = 0;                           ///< kg
  std::vector<std::complex<double>> sensor;  ///< factor of each reading: gain, and angle of the axis
};
CentrifugeDraw draw_centrifuge(const CentrifugeSetup& setup, std::size_t sensors, std::mt19937_64& random);

/// Readings of the sensors of a centrifuge for an imbalance at its buckets.
class CentrifugeModel {
 public:
  /// Throws Error for a file without [centrifuge], without sensors, or with a sensor that is not its own.
  CentrifugeModel(const Rotor& rotor, const CentrifugeSetup& setup, std::vector<CentrifugeSensor> sensors);

  /// Sensors x speeds, for 1 kg m at the mark. `rates` (rad/s^2, empty: none): the force of a shaft that gains speed.
  Eigen::MatrixXcd readings(const CentrifugeDraw& draw, const std::vector<double>& speeds,
                            const std::vector<double>& rates = {}) const;

  /// Forward critical speeds with half the load, ascending, rad/s.
  std::vector<double> forward_criticals(double highest) const;
  const std::vector<CentrifugeSensor>& sensors() const { return sensors_; }

 private:
  System system(const CentrifugeDraw& draw) const;

  Rotor rotor_;  ///< with one unbalance of 1 kg m at the buckets, and supports without stiffness where sensors read
  CentrifugeSetup setup_;
  std::vector<CentrifugeSensor> sensors_;
  std::size_t observers_ = 0;  ///< place of the first of these supports
  Eigen::MatrixXd basis_;
};

}  // namespace whirl::shaft
