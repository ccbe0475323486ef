#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/regression/gram.hpp"

namespace whirl::regression {

/// Penalty R of `sr3` on one coefficient u.
enum class Penalty {
  l0,  ///< 1 where u is not 0
  l1,  ///< |u|
  l2,  ///< u^2
};

/// Settings of `solve_unscaled`. Thresholds and weights hold for coefficients in the units of the problem, ridge and
/// residual for sums over rows: they change with the units of a column and with the number of rows.
struct UnscaledOptions {
  std::string method = "stlsq";  ///< stlsq, sr3, ssr or frols
  double threshold = 0.1;        ///< stlsq: smallest magnitude of a coefficient, >= 0
  double ridge = 0.05;           ///< stlsq, ssr, frols: alpha of |y - Theta xi|^2 + alpha |xi|^2, >= 0
  int max_iterations = 20;       ///< steps of the method, >= 1; frols: largest number of terms
  bool by_residual = false;      ///< ssr: drop the term whose absence costs least, not the smallest coefficient
  Penalty penalty = Penalty::l0;
  Eigen::VectorXd weight = {};  ///< sr3: lambda of each coefficient, >= 0
  double nu = 1;                ///< sr3: relaxation, > 0
  double tolerance = 1e-5;      ///< sr3: ends when the coefficients move by less than this, 2-norm
  std::vector<int> keep = {};   ///< stlsq: indices neither thresholded nor under the ridge
  Eigen::VectorXd start = {};   ///< stlsq, sr3: coefficients to start from; empty: least squares
};

/// The models that a method went through, in its order.
struct UnscaledPath {
  std::vector<Eigen::VectorXd> xi;
  std::vector<double> mean_square;  ///< residual of each, per row
  bool converged = true;            ///< false: ended by max_iterations
};

/// Sparse regression with absolute thresholds, in the form in which the methods were published and other packages have
/// them; `solve` is the form that does not depend on units.
///
/// - stlsq  ridge regression, terms below the threshold go, until none does (Brunton et al. 2016).
/// - sr3    1/2 |y - Theta w|^2 + sum lambda_j R(u_j) + 1/(2 nu) |w - u|^2 (Zheng et al. 2019); the path holds u.
/// - ssr    from all terms to one, one fewer each step (Boninsegna et al. 2018).
/// - frols  from one term to max_iterations by error reduction ratio (Billings 2013), ridge on the terms chosen.
///
/// Throws Error for a name or number that is not allowed and for sizes that do not fit.
UnscaledPath solve_unscaled(const GramBlock& sums, const UnscaledOptions& options);

}  // namespace whirl::regression
