#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

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
  SensitivitySystem(std::vector<SensitiveTerm> terms, std::vector<std::string> states, std::vector<std::string> inputs);
  const std::vector<SensitiveTerm>& terms() const { return terms_; }
  Eigen::Index states() const { return n_; }
  Eigen::Index inputs() const { return m_; }
  /// Free terms.
  Eigen::Index parameters() const { return p_; }
  Eigen::VectorXd free_values() const;
  void set_free_values(const Eigen::VectorXd& theta);

  /// One step of length h of the states x and the sensitivities s: a row per unknown (free terms, then others that act
  /// through the start), a column per state, so that the long dimension is contiguous. Inputs at the beginning, the
  /// middle and the end of the step; with held inputs these are the values that hold within it.
  void step(double h, const double* begin, const double* middle, const double* end, Eigen::VectorXd& x,
            Eigen::MatrixXd& s);

 private:
  void rate(const double* state, const double* input);
  void slope(const Eigen::VectorXd& x, const Eigen::MatrixXd& s, const double* input, std::size_t stage);

  std::vector<SensitiveTerm> terms_;
  Eigen::Index n_, p_, m_;
  std::vector<Eigen::Index> column_;  // sensitivity column of each term, -1 when fixed
  struct Partial {
    std::size_t term;
    Eigen::Index variable;
  };
  std::vector<Partial> partials_;
  expr::Tape tape_;  // functions, then partial derivatives
  Eigen::VectorXd in_, out_, dx_, moved_;
  Eigen::MatrixXd jacobian_, forcing_, moved_s_;
  Eigen::VectorXd x_[4];
  Eigen::MatrixXd s_[4];
};

}  // namespace whirl::identification::detail
