#pragma once
#include <Eigen/Core>
#include <vector>

namespace whirl::identification::detail {

/// What a candidate adds to a model: its columns with all that the terms of the model explain of them taken out, as
/// information Q'Q and gradient Q'r, r the residual of the model.
struct Remainder {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  double share = 0;  ///< of the columns' squares that is left
};
/// From sums over rows, J'J and J'r of all columns: `active` those of the model, `candidate` those of the candidate.
std::vector<Remainder> remainders(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient,
                                  const std::vector<int>& active, const std::vector<std::vector<int>>& candidates);
/// From rows: `basis` orthonormal columns that span those of the model.
Remainder remainder(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& columns, const Eigen::VectorXd& residual);

/// Evidence for a candidate.
struct Evidence {
  /// Fall of the sum of squares in units of the residual variance when the candidate is taken up, to first order,
  /// divided by 1 + 0.18 (unknowns - 1): chi-square with one degree of freedom for a term that is not needed, so that
  /// 16 is four sigma for one, two or four real unknowns.
  double score = 0;
  Eigen::VectorXd coefficient;  ///< of that step
  double sd = 0;                ///< of the coefficient of a term with one real unknown; 0 for others
};

/// Score test (Rao 1948), the one growth test: rotor terms on whitened weak rows and library terms on free runs both
/// come here. Nothing (score 0) where the model explains all of the candidate.
Evidence evidence(const Remainder& remainder, double variance);

}  // namespace whirl::identification::detail
