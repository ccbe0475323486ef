#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/expr/tape.hpp"

namespace whirl::response {

/// What forces the system. Empty input: the rotor turns, X5 = Omega t, X6 = Omega, X7 = 0, other inputs 0. Otherwise
/// the input is amplitude * cos(Omega t), the others 0 and the rotor at rest.
struct Forcing {
  std::string input;
  double amplitude = 0;         ///< unit of the input
  double unbalance_scale = 1;   ///< rotor models: multiplies every term of the angle (eccentricity at the same angle)
  bool free_unbalance = false;  ///< rotor models: the force of a curve multiplies the unbalance too, and must be given
};

/// A model as q^(order) = f(q, q', tau, Omega, F) with tau = Omega t in 0..2 pi. A state whose equation is another
/// state alone (X1' = X2) is a coordinate of order 2 and the other its velocity; the rest are of order 1.
class PeriodicSystem {
 public:
  /// Throws Error for maps, states without equation, an unknown input, or terms of other names.
  PeriodicSystem(const IdentifiedModel& model, const Forcing& forcing);

  Eigen::Index size() const { return static_cast<Eigen::Index>(names_.size()); }  ///< coordinates
  const std::vector<std::string>& names() const { return names_; }
  int order(Eigen::Index i) const { return order_[static_cast<std::size_t>(i)]; }
  double forcing_amplitude() const { return amplitude_; }
  bool driven_by_angle() const { return angle_; }

  /// f and its derivatives at points in rows. `q`, `v`: points x size (v of order-1 coordinates is not read).
  struct Values {
    Eigen::MatrixXd f;         ///< points x size
    Eigen::MatrixXd by_q;      ///< points x size^2, column i * size + j: df_i/dq_j
    Eigen::MatrixXd by_v;      ///< the same by velocity
    Eigen::MatrixXd by_speed;  ///< points x size
    Eigen::MatrixXd by_force;  ///< points x size
  };
  Values evaluate(const Eigen::MatrixXd& q, const Eigen::MatrixXd& v, const Eigen::VectorXd& tau, double omega,
                  double force) const;

 private:
  std::vector<std::string> names_;
  std::vector<int> order_;
  expr::Tape tape_;
  std::vector<int> column_;  ///< tape output -> column of Values, all in a row; -1 never
  double amplitude_ = 0;
  bool angle_ = false;
};

/// The five parameters (and anisotropy) of a rotor as equations of X1..X7: for models that hold only the rotor.
IdentifiedModel rotor_equations(const RotorModel& rotor);

}  // namespace whirl::response
