#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/summary.hpp"
#include "whirl/regression/gram.hpp"

namespace whirl::regression {

/// How one model is taken from a path of models.
enum class Selection {
  automatic,  ///< the method's own rule (see `solve`)
  bic,        ///< Schwarz 1978: n log(rss/n) + k log n
  aic,        ///< Akaike 1974: n log(rss/n) + 2 k
  cv,         ///< smallest mean squared error over held-out contiguous time blocks
  cv_1se,     ///< sparsest model within one standard error of that
};

struct LassoOptions {
  double lambda = -1;  ///< lasso and sqrt_lasso weight as a share of the smallest that empties the model; < 0: selected
  int path_points = 100;  ///< weights on the path
  double path_floor = 0;  ///< smallest weight as a share of the largest; 0: 1e-6 and then 0 (lasso), 1e-4 (lasso_cd)
  bool debias = false;    ///< least squares on the support found
};

struct EnsembleOptions {
  int resamples = 100;         ///< block bootstraps, >= 1
  double inclusion = 0.6;      ///< terms kept in at least this share of the resamples stay
  int drop_terms = 0;          ///< library bagging, terms left out of each resample at random
  std::string base = "stlsq";  ///< method of each resample
  std::uint64_t seed = 1;
};

/// What is known of single terms beforehand.
struct TermRules {
  std::vector<int> keep = {};  ///< indices never penalised nor dropped, e.g. the constant (an offset of the sensor)
  std::vector<int> sign = {};  ///< per term: +1 means >= 0, -1 means <= 0, 0 free; empty: all free
};

/// Settings of `solve`. Thresholds are shares: |xi_j| rms(column j) / rms(y), so that neither the unit of a column nor
/// the number of rows matters.
struct SolveOptions {
  std::string method = "stlsq";  ///< one of regression_methods()
  Selection selection = Selection::automatic;
  double threshold = 0.02;  ///< share below which a term is dropped (stlsq, sr3, ensemble), [0, 1)
  double ridge = 0;         ///< ridge on columns and target scaled to rms 1 (ols, ridge, stlsq), >= 0
  LassoOptions lasso = {};
  int folds = 5;       ///< each of every folds-th contiguous time block, >= 2
  int max_terms = 0;   ///< largest model of frols, best_subset; 0: all
  double t_value = 4;  ///< backward: terms with a smaller |t| go
  double sr3_nu = 1;   ///< sr3: relaxation on scaled columns, > 0
  EnsembleOptions ensemble = {};
  double noise_floor = 0;  ///< bic, aic: rows carry an error of this share of rms(y) that no term can explain
  TermRules rules = {};
};

/// One model of a path.
struct PathPoint {
  double parameter = 0;  ///< lambda as a share of lambda_max (lasso), number of terms (subset methods)
  Eigen::VectorXd xi;
  int terms = 0;
  double rss = 0, bic = 0, aic = 0;
  double cv_mean = 0, cv_se = 0;  ///< mean squared error over the folds and its standard error; 0 when not computed
};

/// Result of a sparse regression.
struct SparseFit {
  std::string method;
  Eigen::VectorXd xi;        ///< coefficients in the units of the problem, 0 for dropped terms
  std::vector<int> support;  ///< ascending
  Eigen::VectorXd sd;  ///< standard deviations on the support for independent rows of equal variance, NaN elsewhere
  double residual_variance = 0;  ///< rss / (rows - terms)
  double bic = 0, aic = 0;
  double parameter = 0;  ///< of the path point chosen
  std::vector<PathPoint> path;
  Eigen::VectorXd inclusion;  ///< ensemble: share of resamples in which each term is kept
  Summary summary;            ///< condition number of the scaled columns kept, residual = rms of rows / rms of y
};

/// Names accepted by `solve`.
const std::vector<std::string>& regression_methods();

/// Sparse regression of `problem` on its Gram matrix, columns and target scaled to rms 1 (D = diag of the column rms):
///
/// - ols          least squares.
/// - ridge        + ridge |D xi|^2 (Hoerl and Kennard 1970).
/// - lasso        1/(2n) |y - Theta xi|^2 + alpha |D xi|_1, the squared form of paper eq. 19 (Tibshirani 1996), exact
///                piecewise linear path by homotopy (Osborne et al. 2000; Efron et al. 2004). Automatic: cv.
/// - lasso_cd     the same by cyclic coordinate descent on the Gram matrix (Friedman et al. 2010). Slow to converge on
///                nearly dependent columns, so that its path ends early: prefer lasso.
/// - sqrt_lasso   |y - Theta xi|_2 / sqrt n + lambda |D xi|_1, paper eq. 19 as printed; automatic lambda is the pivotal
/// one
///                1.1 Phi^-1(1 - 0.05/(2q)) / sqrt n (Belloni et al. 2011), found on the exact path.
/// - lspl         least squares on every support of the lasso path. Automatic: bic.
/// - stlsq        sequentially thresholded least squares (Brunton et al. 2016) with share threshold.
/// - sr3, sr3_l1  sparse relaxed regularised regression, l0 or l1 (Zheng et al. 2019), then least squares on its
/// support.
/// - ssr          stepwise: drop the smallest share, refit, down to one term (Boninsegna et al. 2018). Automatic: bic.
/// - frols        forward orthogonal least squares by error reduction ratio (Billings 2013). Automatic: bic.
/// - best_subset  smallest residual of every model size, exact, by branch and bound on triangular factors (Furnival and
///                Wilson 1974; Gatu and Kontoghiorghes 2006), with sign bounds too. Automatic: bic. Use up to about 40
///                terms.
/// - backward     drop the smallest |t| until all are at least `t_value`.
/// - ensemble     `base` on block bootstraps (Fasel et al. 2022); least squares on terms with inclusion >= `inclusion`.
///
/// Linear ties are eliminated beforehand (`eliminate`, `reduce`). Throws Error on unknown names or sizes that do not
/// fit; singular or empty fits are told in the summary.
SparseFit solve(const Problem& problem, const SolveOptions& options = {});

/// Least squares on a given support, honouring `options.sign` (active set, Lawson and Hanson 1974) and `options.ridge`.
Eigen::VectorXd refit(const GramBlock& sums, const std::vector<int>& support, const SolveOptions& options = {});

/// A point of the exact lasso path: solution xi(alpha) is linear between points.
struct LassoKnot {
  double alpha = 0;    ///< weight on scaled columns and scaled target
  Eigen::VectorXd xi;  ///< scaled coefficients
};
/// Exact lasso path of a scaled problem (unit-rms columns and target, sums divided by rows) from the empty model down
/// to `alpha_end`. `keep` are not penalised, `sign` as in SolveOptions.
std::vector<LassoKnot> lasso_path(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment, double alpha_end = 0,
                                  const std::vector<int>& keep = {}, const std::vector<int>& sign = {});

}  // namespace whirl::regression
