#pragma once
#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "whirl/core/decompositions.hpp"
#include "whirl/expr/tape.hpp"

/// Parameters p from relations c(p) = u to observed values u: nonlinear least squares with many starts.
namespace whirl::lagrange {

/// Relations c(p) = u with their derivatives, exact values put in.
class Relations {
 public:
  Relations(const std::vector<expr::Expr>& terms, const std::vector<std::string>& names)
      : rows_(static_cast<Eigen::Index>(terms.size())), columns_(static_cast<Eigen::Index>(names.size())) {
    std::vector<expr::Expr> all = terms;
    for (const expr::Expr& term : terms) {
      for (const std::string& name : names) all.push_back(expr::differentiate(term, name));
    }
    tape_ = expr::compile(all, names);
  }
  void evaluate(const Eigen::VectorXd& p, Eigen::VectorXd& value, Eigen::MatrixXd& jacobian) const {
    Eigen::VectorXd out(rows_ * (1 + columns_));
    tape_.evaluate_point(p.data(), out.data());
    value = out.head(rows_);
    jacobian = out.tail(rows_ * columns_).reshaped<Eigen::RowMajor>(rows_, columns_);
  }

 private:
  Eigen::Index rows_, columns_;
  expr::Tape tape_;
};

struct RelationProblem {
  std::vector<std::string> names;  // of the parameters sought
  std::vector<std::string> units;
  std::vector<expr::Expr> relations;  // one per observation, in `names`
  Eigen::VectorXd observed;
  Eigen::MatrixXd whitening;  // L^-1 of the observations' covariance L L^T

  /// Natural step of a parameter: its own size, one radian for an angle.
  Eigen::VectorXd scale(const Eigen::VectorXd& p) const;
  bool is_angle(Eigen::Index k) const { return units[static_cast<std::size_t>(k)] == "rad"; }
};

struct RelationSolution {
  Eigen::VectorXd p;
  Eigen::MatrixXd jacobian;  // of the relations
  double chi_square = std::numeric_limits<double>::infinity();
};

RelationSolution solve(const RelationProblem& problem, const Relations& relations);

/// Inverse square root of the covariance. Exact or missing uncertainties count as 1e-7 of the value: they must not
/// rule.
Eigen::MatrixXd whitening(const Eigen::VectorXd& value, Eigen::MatrixXd covariance);

/// Least squares, of minimal norm where a is rank-deficient.
Eigen::MatrixXd minimal_norm(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace whirl::lagrange
