#pragma once
#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "output_error/sensitivity_step.hpp"
#include "whirl/expr/expr.hpp"
#include "whirl/expr/tape.hpp"

namespace whirl::identification::detail {

/// One term of a right-hand side: theta * function in the equation of state `state`.
struct SensitiveTerm {
  Eigen::Index state = 0;
  expr::Expr function;
  double theta = 0;
  bool free = true;  ///< has a sensitivity column
};

/// RK4 of states and sensitivities of x' = sum theta f(x, u).
class SensitivitySystem {
 public:
  SensitivitySystem(const std::vector<SensitiveTerm>& terms, const std::vector<std::string>& states,
                    const std::vector<std::string>& inputs);
  Eigen::Index states() const { return n_; }
  Eigen::Index inputs() const { return m_; }
  /// Free terms.
  Eigen::Index parameters() const { return p_; }
  Eigen::VectorXd free_values() const;
  void set_free_values(const Eigen::VectorXd& theta);

  /// One step of length h of the states x and the sensitivities s: a row per unknown (free terms, then others that act
  /// through the start; SensitivityStep::rows), a column per state: the long dimension is contiguous. Inputs at the
  /// beginning, the middle and the end of the step; with held inputs these are the values that hold within it.
  void step(double h, const double* begin, const double* middle, const double* end, Eigen::VectorXd& x,
            Eigen::MatrixXd& s);

 private:
  struct Partial {
    std::size_t term;
    Eigen::Index output;
  };
  void stage(int k, const double* input);

  Eigen::Index n_, p_, m_;
  expr::Tape tape_;  // functions, then partial derivatives
  SensitivityStep step_;
  // Flat, as a stage goes through them.
  std::vector<double> theta_;
  std::vector<Eigen::Index> place_;                             // of each term in a stage's forcing, -1 when fixed
  std::vector<std::pair<Eigen::Index, std::size_t>> of_state_;  // terms of one state, one after the other: their end
  std::vector<Partial> partials_;                               // entry of the Jacobian by entry
  std::vector<std::size_t> entry_ends_;
  std::vector<double> slots_;  // of the tape
  Eigen::VectorXd in_, out_;
  std::array<Eigen::VectorXd, 4> rates_;
};

}  // namespace whirl::identification::detail
