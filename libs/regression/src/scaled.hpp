#pragma once
// The regression problem as every method of `solve` sees it: columns and target of rms 1.
#include <Eigen/Core>
#include <vector>

#include "whirl/regression/regression.hpp"

namespace whirl::regression::detail {

struct Scaled {
  Eigen::MatrixXd g;            // correlation-like Gram matrix, unit diagonal (0 for empty columns)
  Eigen::VectorXd c;            // moments; the energy of the target is 1
  Eigen::VectorXd unit;         // xi = unit .* w
  std::vector<int> candidates;  // usable columns that may be dropped, ascending
  std::vector<int> keep;        // usable columns always kept, ascending
  std::vector<int> sign;        // per column
  double rows = 0;              // for criteria
  double y_rms = 0;
  double floor = 0;  // error of the rows that no term can explain, share of the target

  Eigen::Index size() const { return c.size(); }
  double rss(const Eigen::VectorXd& w) const;  // mean squared residual, scaled target: in [0, 1] for least squares
};

Scaled scale(const GramBlock& block, const SolveOptions& options, double rows);
/// The sums of `block` in the units of `like` (columns and target divided alike, per row of `block`).
Scaled scale_like(const GramBlock& block, const Scaled& like);

/// Least squares on a support (with signs of s.sign), w of full size.
Eigen::VectorXd least_squares(const Scaled& s, const std::vector<int>& support, double ridge = 0);
std::vector<int> support_of(const Eigen::VectorXd& w);
std::vector<int> all_terms(const Scaled& s);

/// bic and aic for a mean squared residual (share of the target's) and a number of terms.
double bic(const Scaled& s, double mean_square, int terms);
double aic(const Scaled& s, double mean_square, int terms);

struct Path {
  std::vector<double> parameter;
  std::vector<Eigen::VectorXd> w;
  // Per fold and path point: mean squared error on the held-out fold; empty without cross-validation.
  Eigen::MatrixXd cv;       // folds x points
  Eigen::VectorXd cv_rows;  // rows per fold
};

struct Fold {
  Scaled train, test;
};
/// Folds in the scaling of `s`: fold f holds the contiguous time blocks f, f + folds, ... A run-up changes speed from
/// block to block: one long block per fold would train on other speeds than it tests.
std::vector<Fold> make_folds(const Problem& problem, const Scaled& s, int folds);

Eigen::VectorXd stlsq(const Scaled& s, const SolveOptions& o);
Eigen::VectorXd sr3(const Scaled& s, const SolveOptions& o, bool l1);
Eigen::VectorXd backward(const Scaled& s, const SolveOptions& o);
Path ssr(const Scaled& s);
Path frols(const Scaled& s, int max_terms);
/// Smallest residual of every size. `winners_only`: models larger than the one with the lowest bic are sought only
/// where they could have it, far faster with many candidates; that one and all smaller ones stay exact.
Path best_subset(const Scaled& s, int max_terms, bool winners_only);
/// Order in which backward elimination by residual drops the candidates, last dropped (most needed) first.
std::vector<int> importance_order(const Scaled& s);

std::vector<double> lasso_grid(double alpha_max, const SolveOptions& o);
double lasso_alpha_max(const Scaled& s);
/// Lasso solutions at the weights of a descending grid, by homotopy or coordinate descent.
std::vector<Eigen::VectorXd> lasso_at(const Scaled& s, const std::vector<double>& grid, bool coordinate_descent);
Eigen::VectorXd sqrt_lasso(const Scaled& s, const SolveOptions& o, double& parameter);
Path lspl(const Scaled& s);

/// Scaled solution of any method; fills path and parameter when they exist.
Eigen::VectorXd run_method(const Problem& problem, const Scaled& s, const SolveOptions& o, Path* path,
                           double* parameter, Eigen::VectorXd* inclusion);

}  // namespace whirl::regression::detail
