#pragma once
#include <Eigen/Core>
#include <optional>
#include <random>
#include <vector>

#include "whirl/core/identified_model.hpp"

namespace whirl::pages {

/// Models drawn from what an identification leaves open.
///
/// A rotor's k1, k2, c and eps come from `rotor_covariance`, its anisotropy, further forces and further modes from
/// `parameter_covariance`, both jointly (a model without the latter: from their own intervals). Coefficients of other
/// equations come from `parameter_covariance` where each is a parameter, by name or by size and deviation, else from
/// their own intervals; those of the same size and deviation are one number (a tied library).
class ModelDraws {
 public:
  ModelDraws(const IdentifiedModel& model, unsigned seed);
  /// False where the model states no uncertainty: every draw is the model itself.
  bool any() const { return root_.cols() > 0; }
  IdentifiedModel operator()();

 private:
  void take(const Eigen::MatrixXd& covariance);
  void join_rotor();
  void join_coefficients();

  IdentifiedModel model_;
  bool rotor_ = false;
  std::vector<std::size_t> further_;  ///< rotor: parameters beyond the five
  struct Place {
    std::size_t equation, term;
    double sign;
  };
  std::vector<std::vector<Place>> places_;  ///< other models: where each number stands
  Eigen::MatrixXd root_;                    ///< covariance = root root^T
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace whirl::pages
