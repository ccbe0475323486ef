#pragma once
#include <Eigen/Core>
#include <vector>

#include "centrifuge/sensor_model.hpp"
#include "whirl/core/estimate.hpp"

namespace whirl::shaft {

/// What the blocks of a spin-up say of an imbalance.
struct LoadRecord {
  std::vector<double> speeds, rates;  ///< of the blocks, rad/s, rad/s^2
  Eigen::MatrixXcd vectors;           ///< sensors x blocks
  Eigen::MatrixXd weights;            ///< 1 / standard deviation of real and imaginary part
};

/// Values of the imbalance, kg m, with weights that sum to 1.
struct LoadSamples {
  Eigen::VectorXcd values;
  Eigen::VectorXd weights;
  double noise_sd = 0;             ///< of each part by the noise alone, kg m, in the best machine
  double tolerance_sd = 0;         ///< of its size by the tolerances alone, relative
  double misfit = 1;               ///< variance of the weighted residual of the best machine
  Eigen::MatrixXcd residuals;      ///< of that, weighted
  Eigen::VectorXcd last_readings;  ///< of that at the last block, per kg m
};

/// Samples of the posterior, see `check_load`.
LoadSamples sample_load(const CentrifugeModel& model, const CentrifugeSetup& setup, const LoadRecord& record, int draws,
                        unsigned seed);

/// The shortest interval that holds 95 % of the weight, with the median.
Estimate shortest_interval(const Eigen::VectorXd& values, const Eigen::VectorXd& weights);
/// The same of angles, about their mean direction; low and high may lie beyond +-pi.
Estimate shortest_arc(const Eigen::VectorXcd& values, const Eigen::VectorXd& weights);

}  // namespace whirl::shaft
