#pragma once
#include <Eigen/Core>
#include <vector>

namespace whirl::identification::detail {

/// What free runs leave as a function of the coefficients xi of one equation's candidate terms, all else at its best
/// for each: cost(xi) = energy - 2 moment' xi + xi' information xi. Exact along what follows the records as the model
/// does, to first order elsewhere.
struct TermCost {
  Eigen::MatrixXd information;
  Eigen::VectorXd moment;
  double energy = 0;
  double rows = 0;        ///< independent numbers compared
  std::vector<int> sign;  ///< per term: +1 means >= 0, -1 means <= 0, 0 free
};
/// From sums over rows of all coefficients, about the present ones `xi` (0: not in the model) with their `cost`. `own`:
/// those of the equation; `others`: those of the rest of the model.
TermCost term_cost(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient, const std::vector<int>& own,
                   const std::vector<int>& others, const Eigen::VectorXd& xi, double cost, double rows);

/// Another set of terms of one equation.
struct TermSet {
  std::vector<int> terms;  ///< ascending
  Eigen::VectorXd xi;      ///< one per term of `terms`
  double excess = 0;       ///< its criterion, rows log(cost) + terms log(rows) (Schwarz 1978), above that of the model
};
/// Sets that lack a term of the model, hold another one instead and whose criterion is at most `margin` above the
/// model's, best first. Every term of the model is left out in turn and the best set of every size, up to one more
/// than the model has, is found exactly without it: no set that lacks this term does better.
std::vector<TermSet> rival_sets(const TermCost& cost, const std::vector<int>& present, double margin);

}  // namespace whirl::identification::detail
