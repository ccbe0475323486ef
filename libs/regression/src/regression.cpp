#include "whirl/regression/regression.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <random>

#include "scaled.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::regression {
namespace detail {
namespace {

/// Fills the held-out error of every path point: models with a support are fitted again on the other folds.
void cross_validate_supports(const Problem& problem, const Scaled& s, int folds, Path& path) {
  const std::vector<Fold> parts = make_folds(problem, s, folds);
  path.cv.resize(static_cast<Eigen::Index>(parts.size()), static_cast<Eigen::Index>(path.w.size()));
  for (std::size_t f = 0; f < parts.size(); ++f) {
    const double energy = std::pow(parts[f].test.y_rms / s.y_rms, 2);
    for (std::size_t k = 0; k < path.w.size(); ++k) {
      const Eigen::VectorXd w = least_squares(parts[f].train, support_of(path.w[k]));
      path.cv(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(k)) =
          std::max(0.0, parts[f].test.rss(w) - 1 + energy);
    }
  }
}

Path lasso_with_path(const Problem& problem, const Scaled& s, const SolveOptions& o, bool descent, bool validate) {
  Path path;
  const double alpha_max = lasso_alpha_max(s);
  const std::vector<double> grid = lasso_grid(alpha_max, o);
  path.w = lasso_at(s, grid, descent);
  for (double alpha : grid) path.parameter.push_back(alpha_max > 0 ? alpha / alpha_max : 0);
  if (!validate) return path;
  const std::vector<Fold> parts = make_folds(problem, s, o.folds);
  path.cv.resize(static_cast<Eigen::Index>(parts.size()), static_cast<Eigen::Index>(grid.size()));
  for (std::size_t f = 0; f < parts.size(); ++f) {
    const std::vector<Eigen::VectorXd> w = lasso_at(parts[f].train, grid, descent);
    const double energy = std::pow(parts[f].test.y_rms / s.y_rms, 2);
    for (std::size_t k = 0; k < w.size(); ++k) {
      path.cv(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(k)) =
          std::max(0.0, parts[f].test.rss(w[k]) - 1 + energy);
    }
  }
  return path;
}

struct CvCurve {
  Eigen::VectorXd mean, se;
};
CvCurve cv_curve(const Path& path) {
  CvCurve c;
  const Eigen::Index folds = path.cv.rows(), points = path.cv.cols();
  c.mean = Eigen::VectorXd::Zero(points);
  c.se = Eigen::VectorXd::Zero(points);
  if (folds == 0) return c;
  for (Eigen::Index k = 0; k < points; ++k) {
    c.mean[k] = path.cv.col(k).mean();
    if (folds > 1) {
      const double var = (path.cv.col(k).array() - c.mean[k]).square().sum() / static_cast<double>(folds - 1);
      c.se[k] = std::sqrt(var / static_cast<double>(folds));
    }
  }
  return c;
}

std::size_t choose(const Path& path, const Scaled& s, Selection rule) {
  const std::size_t n = path.w.size();
  std::vector<double> score(n);
  std::vector<int> terms(n);
  const bool by_cv = rule == Selection::cv || rule == Selection::cv_1se;
  if (by_cv && path.cv.rows() == 0) {
    throw Error("cross-validation needs a problem with at least 2 time blocks");
  }
  const CvCurve curve = cv_curve(path);
  for (std::size_t k = 0; k < n; ++k) {
    terms[k] = static_cast<int>(support_of(path.w[k]).size());
    const double mean_square = s.rss(path.w[k]);
    score[k] = by_cv                    ? curve.mean[static_cast<Eigen::Index>(k)]
               : rule == Selection::aic ? aic(s, mean_square, terms[k])
                                        : bic(s, mean_square, terms[k]);
  }
  std::size_t best = 0;
  for (std::size_t k = 1; k < n; ++k) {
    if (score[k] < score[best] || (score[k] == score[best] && terms[k] < terms[best])) best = k;
  }
  if (rule == Selection::cv_1se) {
    const double limit = score[best] + curve.se[static_cast<Eigen::Index>(best)];
    for (std::size_t k = 0; k < n; ++k) {
      if (score[k] <= limit && terms[k] < terms[best]) best = k;
    }
  }
  return best;
}

Eigen::VectorXd ensemble(const Problem& problem, const Scaled& s, const SolveOptions& o, Eigen::VectorXd& inclusion) {
  const std::size_t n = problem.blocks.size();
  if (n < 2) throw Error("an ensemble needs a problem with at least 2 time blocks");
  if (o.ensemble.base == "ensemble")
    throw Error::in_field("ensemble base", o.ensemble.base, "a method other than ensemble");
  if (o.ensemble.resamples < 1) throw Error::in_field("resamples", std::to_string(o.ensemble.resamples), "at least 1");
  SolveOptions inner = o;
  inner.method = o.ensemble.base;
  std::mt19937_64 engine(o.ensemble.seed);
  std::uniform_int_distribution<std::size_t> pick(0, n - 1);
  Eigen::VectorXd kept = Eigen::VectorXd::Zero(s.size()), offered = Eigen::VectorXd::Zero(s.size());
  for (int r = 0; r < o.ensemble.resamples; ++r) {
    std::vector<int> times(n, 0);
    for (std::size_t b = 0; b < n; ++b) ++times[pick(engine)];
    Problem sample;
    sample.total = {Eigen::MatrixXd::Zero(s.size(), s.size()), Eigen::VectorXd::Zero(s.size()), 0, 0};
    sample.effective_rows = problem.effective_rows;
    for (std::size_t b = 0; b < n; ++b) {
      if (times[b] == 0) continue;
      const double k = times[b];
      sample.total.gram += k * problem.blocks[b].gram;
      sample.total.moment += k * problem.blocks[b].moment;
      sample.total.energy += k * problem.blocks[b].energy;
      sample.total.rows += k * problem.blocks[b].rows;
      sample.blocks.push_back(problem.blocks[b]);
    }
    if (!(sample.total.energy > 0)) continue;
    Scaled t = scale(sample.total, inner, sample.information_rows());
    if (o.ensemble.drop_terms > 0) {
      std::vector<int> shuffled = t.candidates;
      std::shuffle(shuffled.begin(), shuffled.end(), engine);
      shuffled.resize(shuffled.size() - std::min(shuffled.size(), static_cast<std::size_t>(o.ensemble.drop_terms)));
      std::sort(shuffled.begin(), shuffled.end());
      t.candidates = std::move(shuffled);
    }
    for (int j : all_terms(t)) offered[j] += 1;
    const Eigen::VectorXd w = run_method(sample, t, inner, nullptr, nullptr, nullptr);
    for (int j : support_of(w)) kept[j] += 1;
  }
  inclusion = kept.array() / offered.array().max(1.0);
  std::vector<int> support;
  for (int j : all_terms(s)) {
    const bool forced = std::find(s.keep.begin(), s.keep.end(), j) != s.keep.end();
    if (forced || inclusion[j] >= o.ensemble.inclusion) support.push_back(j);
  }
  return least_squares(s, support, o.ridge);
}

/// A regression method: either weights at once, or a path of which a selection rule takes one. Those with neither
/// (lasso, ensemble) need the blocks of the problem too and are called below by name.
struct Method {
  std::string name;
  Eigen::VectorXd (*solve)(const Scaled& s, const SolveOptions& o) = nullptr;
  Path (*path)(const Scaled& s, const SolveOptions& o) = nullptr;
};

/// The catalogue: a new method is its source, a declaration in scaled.hpp and one line here.
/// A largest size says that larger models are not wanted for themselves: those that cannot win are not sought.
bool winners_alone(const SolveOptions& o) {
  return o.max_terms > 0 && (o.selection == Selection::automatic || o.selection == Selection::bic);
}

const std::vector<Method>& methods() {
  using Options = SolveOptions;
  static const std::vector<Method> all = {
      {"ols", [](const Scaled& s, const Options&) { return least_squares(s, all_terms(s), 0); }},
      {"ridge", [](const Scaled& s, const Options& o) { return least_squares(s, all_terms(s), o.ridge); }},
      {"lasso"},
      {"lasso_cd"},
      {"sqrt_lasso"},
      {"lspl", nullptr, [](const Scaled& s, const Options&) { return lspl(s); }},
      {"stlsq", stlsq},
      {"sr3", [](const Scaled& s, const Options& o) { return sr3(s, o, false); }},
      {"sr3_l1", [](const Scaled& s, const Options& o) { return sr3(s, o, true); }},
      {"ssr", nullptr, [](const Scaled& s, const Options&) { return ssr(s); }},
      {"frols", nullptr, [](const Scaled& s, const Options& o) { return frols(s, o.max_terms); }},
      {"best_subset", nullptr,
       [](const Scaled& s, const Options& o) { return best_subset(s, o.max_terms, winners_alone(o)); }},
      {"backward", backward},
      {"ensemble"}};
  return all;
}

}  // namespace

Eigen::VectorXd run_method(const Problem& problem, const Scaled& s, const SolveOptions& o, Path* path_out,
                           double* parameter, Eigen::VectorXd* inclusion) {
  const std::string& m = o.method;
  const Method& method =
      *std::find_if(methods().begin(), methods().end(), [&](const Method& x) { return x.name == m; });
  if (method.solve != nullptr) return method.solve(s, o);
  if (m == "ensemble") {
    Eigen::VectorXd share;
    Eigen::VectorXd w = ensemble(problem, s, o, share);
    if (inclusion != nullptr) *inclusion = share;
    return w;
  }
  if (m == "sqrt_lasso") {
    double found = 0;
    Eigen::VectorXd w = sqrt_lasso(s, o, found);
    if (parameter != nullptr) *parameter = found;
    return o.lasso.debias ? least_squares(s, support_of(w)) : w;
  }
  const bool lasso = m == "lasso" || m == "lasso_cd";
  if (lasso && o.lasso.lambda >= 0) {
    const double alpha = o.lasso.lambda * lasso_alpha_max(s);
    const Eigen::VectorXd w = lasso_at(s, {alpha}, m == "lasso_cd").front();
    if (parameter != nullptr) *parameter = o.lasso.lambda;
    return o.lasso.debias ? least_squares(s, support_of(w)) : w;
  }
  const Selection rule = o.selection != Selection::automatic ? o.selection : lasso ? Selection::cv : Selection::bic;
  const bool validate = rule == Selection::cv || rule == Selection::cv_1se || (path_out != nullptr && lasso);
  Path path;
  if (lasso) {
    path = lasso_with_path(problem, s, o, m == "lasso_cd", validate);
  } else {
    path = method.path(s, o);
    if (validate) cross_validate_supports(problem, s, o.folds, path);
  }
  const std::size_t best = choose(path, s, rule);
  if (parameter != nullptr) *parameter = path.parameter[best];
  Eigen::VectorXd w = path.w[best];
  if (lasso && o.lasso.debias) w = least_squares(s, support_of(w));
  if (path_out != nullptr) *path_out = std::move(path);
  return w;
}

}  // namespace detail

const std::vector<std::string>& regression_methods() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const detail::Method& m : detail::methods()) all.push_back(m.name);
    return all;
  }();
  return names;
}

namespace {
void check(const Problem& problem, const SolveOptions& o) {
  const auto& names = regression_methods();
  for (const std::string& m : {o.method, o.ensemble.base}) {
    if (std::find(names.begin(), names.end(), m) == names.end()) {
      throw Error::in_field("regression method", m, fmt::format("one of {}", fmt::join(names, ", ")));
    }
  }
  require_range("threshold", o.threshold, 0, 1);
  require_range("ridge", o.ridge, 0, 1e12);
  require_range("sr3 nu", o.sr3_nu, 1e-12, 1e12);
  require_range("inclusion", o.ensemble.inclusion, 0, 1);
  require_range("noise floor", o.noise_floor, 0, 1);
  const GramBlock& t = problem.total;
  if (t.gram.rows() != t.terms() || t.gram.cols() != t.terms() || t.terms() < 1) {
    throw Error(
        fmt::format("Gram matrix {} x {} with {} moments: sizes must agree", t.gram.rows(), t.gram.cols(), t.terms()));
  }
  if (!(t.rows >= 1)) throw Error("a regression needs at least one row of finite values");
  if (!t.gram.allFinite() || !t.moment.allFinite() || !std::isfinite(t.energy)) {
    throw Error("the sums of the regression are not finite: a column overflows");
  }
}
}  // namespace

SparseFit solve(const Problem& problem, const SolveOptions& options) {
  check(problem, options);
  const detail::Scaled s = detail::scale(problem.total, options, problem.information_rows());
  SparseFit fit;
  fit.method = options.method;
  const Eigen::Index q = s.size();
  fit.sd = Eigen::VectorXd::Constant(q, std::numeric_limits<double>::quiet_NaN());
  fit.xi = Eigen::VectorXd::Zero(q);
  if (!(s.y_rms > 0)) {
    fit.summary.residual = 0;
    fit.summary.warn("the target is zero: no term is needed");
    return fit;
  }
  detail::Path path;
  const Eigen::VectorXd w = detail::run_method(problem, s, options, &path, &fit.parameter, &fit.inclusion);
  const double energy = s.y_rms * s.y_rms * problem.total.rows;
  const Eigen::Index folds = path.cv.rows();
  const detail::CvCurve curve = detail::cv_curve(path);
  for (std::size_t k = 0; k < path.w.size(); ++k) {
    PathPoint p;
    p.parameter = path.parameter[k];
    p.xi = s.unit.cwiseProduct(path.w[k]);
    p.terms = static_cast<int>(detail::support_of(path.w[k]).size());
    const double mean_square = s.rss(path.w[k]);
    p.rss = mean_square * energy;
    p.bic = detail::bic(s, mean_square, p.terms);
    p.aic = detail::aic(s, mean_square, p.terms);
    if (folds > 0) {
      p.cv_mean = curve.mean[static_cast<Eigen::Index>(k)] * s.y_rms * s.y_rms;
      p.cv_se = curve.se[static_cast<Eigen::Index>(k)] * s.y_rms * s.y_rms;
    }
    fit.path.push_back(std::move(p));
  }
  fit.xi = s.unit.cwiseProduct(w);
  fit.support = detail::support_of(w);
  const int k = static_cast<int>(fit.support.size());
  const double mean_square = s.rss(w);
  fit.bic = detail::bic(s, mean_square, k);
  fit.aic = detail::aic(s, mean_square, k);
  fit.residual_variance = mean_square * energy / std::max(1.0, problem.total.rows - k);
  fit.summary.residual = std::sqrt(mean_square);
  if (k == 0) {
    fit.summary.warn("no term was kept");
    return fit;
  }
  const Eigen::MatrixXd g = s.g(fit.support, fit.support);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(g);
  const double low = eigen.eigenvalues()[0], high = eigen.eigenvalues()[k - 1];
  fit.summary.condition_number = low > 0 ? std::sqrt(high / low) : std::numeric_limits<double>::infinity();
  if (!(low > 1e-14 * high)) {
    fit.summary.warn("the kept columns are linearly dependent on this record: their coefficients are not unique");
  }
  const double variance = mean_square / std::max(1.0, s.rows - k);
  for (int i = 0; i < k; ++i) {
    double inverse = 0;  // diagonal of g^-1
    for (int j = 0; j < k; ++j) {
      const double v = eigen.eigenvectors()(i, j);
      inverse += v * v / std::max(eigen.eigenvalues()[j], 1e-300);
    }
    const int j = fit.support[static_cast<std::size_t>(i)];
    fit.sd[j] = s.unit[j] * std::sqrt(variance * inverse);
  }
  return fit;
}

Eigen::VectorXd refit(const GramBlock& sums, const std::vector<int>& support, const SolveOptions& options) {
  const detail::Scaled s = detail::scale(sums, options, sums.rows);
  if (!(s.y_rms > 0)) return Eigen::VectorXd::Zero(s.size());
  return s.unit.cwiseProduct(detail::least_squares(s, support, options.ridge));
}

}  // namespace whirl::regression
