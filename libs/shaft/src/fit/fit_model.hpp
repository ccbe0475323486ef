#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/parameters.hpp"
#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

/// The steady state at one speed: coordinates (x, y) per unit of each force column, and of each probe its row times the
/// inverse of the dynamic stiffness.
struct SteadyPoint {
  Eigen::MatrixXcd answers;   ///< 2 r x columns
  Eigen::MatrixXcd adjoint;   ///< 2 r x probes
  Eigen::MatrixXcd readings;  ///< probes x columns
};

/// The rotor in few coordinates as a function of the structural unknowns. Matrices are linear in those of geometry
/// about the place where it was made, which holds to second order within drawing tolerances; supports are exact. Its
/// shapes are those of that place: a frequency is off by the square of what a shape lacks (Rayleigh).
class FitModel {
 public:
  /// About the values `t`; `trials` holds the stations of known masses, force columns after those of the unknowns.
  FitModel(const Rotor& drawn, ParameterSet set, const std::vector<Trial>& trials, const Eigen::VectorXd& t, int modes);

  /// Sets the structural values.
  void set(const Eigen::VectorXd& t);

  SteadyPoint steady(double speed) const;
  /// Slopes of the probes' steady readings over the structural unknowns, for one size of each force column: probes x
  /// structural.
  Eigen::MatrixXcd steady_slopes(double speed, const SteadyPoint& point, const Eigen::VectorXcd& sizes) const;

  /// M, C and K at a speed in (q_x, q_y), real; and their slopes over the speed (mass: none).
  Equations<Eigen::MatrixXd> equations(double speed) const;
  Equations<Eigen::MatrixXd> speed_slopes(double speed) const;
  /// (s^2 dM + s dC + dK) v over each structural unknown, for a motion e^{st}: 2 r x structural.
  Eigen::MatrixXcd dynamic_slopes(double speed, std::complex<double> s, const Eigen::VectorXcd& v) const;
  /// Slope of `force` over a structural unknown; empty where there is none.
  Eigen::MatrixXcd force_slopes(Eigen::Index parameter) const;
  /// Force of a column on (q_x, q_y) for a motion e^{i theta}, without its factor over speed.
  Eigen::VectorXcd force(Eigen::Index column) const;
  /// Unbalance: speed squared; bow: 1.
  double factor(Eigen::Index column, double speed) const { return is_bow(column) ? 1 : speed * speed; }
  bool is_bow(Eigen::Index column) const { return column >= set_.stations && column < set_.stations + set_.bows; }
  /// What a probe reads of (q_x, q_y).
  const Eigen::MatrixXd& probe_rows() const { return probe_rows_; }

  Eigen::Index size() const { return reduced_.size(); }
  Eigen::Index columns() const { return columns_.cols(); }
  const ParameterSet& parameters() const { return set_; }
  const Rotor& drawn() const { return drawn_; }
  const std::vector<Trial>& trials() const { return trials_; }
  const Eigen::VectorXd& values() const { return t_; }
  int modes() const { return modes_; }
  /// Sizes of the columns: unknowns of `t`, then of each trial that is on the shaft during `run`.
  Eigen::VectorXcd sizes(const Eigen::VectorXd& t, const std::string& run) const;
  /// Rows by which a support feels (q_x or q_y).
  const Eigen::VectorXd& support_row(std::size_t k) const { return reduced_.supports[k].row; }
  const SupportLaw& support_law(std::size_t k) const { return laws_[k]; }

 private:
  struct Slope {
    Eigen::Index parameter = 0;
    Eigen::MatrixXd mass, gyroscopic, stiffness, rotating;
    Eigen::MatrixXd columns;  ///< real and imaginary alike: of unit forces at angle zero
  };
  void project_columns(const Rotor& rotor, const System& full, const Eigen::MatrixXd& basis);
  bool is_support(const Parameter& p) const {
    return p.kind == UnknownKind::stiffness || p.kind == UnknownKind::damping;
  }

  Rotor drawn_;
  ParameterSet set_;
  std::vector<Trial> trials_;
  int modes_;
  System reduced_;
  std::vector<Slope> slopes_;
  Eigen::VectorXd base_;  ///< values at which the matrices were made
  Eigen::MatrixXd base_columns_, columns_;
  Eigen::MatrixXd probe_rows_;
  Eigen::VectorXd t_;
  std::vector<SupportLaw> laws_;
  Eigen::MatrixXd mass_, gyroscopic_, stiffness_, rotating_;
};

}  // namespace whirl::shaft
