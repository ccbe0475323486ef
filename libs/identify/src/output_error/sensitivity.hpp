#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/expr/expr.hpp"
#include "whirl/expr/tape.hpp"
#include "whirl/identify/refine.hpp"

namespace whirl::identification::detail {

/// One term of a right-hand side: theta * function in the equation of state `state`.
struct SensitiveTerm {
  Eigen::Index state = 0;
  expr::Expr function;
  double theta = 0;
  bool free = true;  ///< has a sensitivity column
};

/// Sums of one Gauss-Newton step: unknowns are the free terms in order, then the start of each run.
struct StepSums {
  Eigen::MatrixXd normal;    // J'J
  Eigen::VectorXd gradient;  // J'r
  double cost = 0;           // r'r
  Eigen::VectorXd cost_of;   // the same by output
  Eigen::VectorXd rows_of;
  Eigen::Index rows = 0;
  bool diverged = false;
};

/// RK4 of states and sensitivities of x' = sum theta f(x, u).
class SensitivitySystem {
 public:
  SensitivitySystem(std::vector<SensitiveTerm> terms, std::vector<std::string> states, std::vector<std::string> inputs);
  std::vector<SensitiveTerm>& terms() { return terms_; }
  Eigen::Index states() const { return n_; }
  Eigen::Index parameters() const { return p_; }
  StepSums run(const std::vector<FreeRun>& runs, double dt, const std::vector<Eigen::Index>& outputs,
               const Eigen::VectorXd& weight, Eigen::Index skip, bool free_start);

 private:
  void rate(const double* state, const double* input);
  std::vector<SensitiveTerm> terms_;
  Eigen::Index n_, p_, m_;
  std::vector<Eigen::Index> column_;  // sensitivity column of each term, -1 when fixed
  struct Partial {
    std::size_t term;
    Eigen::Index variable;
  };
  std::vector<Partial> partials_;
  expr::Tape tape_;  // functions, then partial derivatives
  Eigen::VectorXd in_, out_, dx_;
  Eigen::MatrixXd jacobian_, forcing_;
};

}  // namespace whirl::identification::detail
