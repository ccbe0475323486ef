// Exact lasso path by homotopy, coordinate descent, square-root lasso, LSPL.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "scaled.hpp"

namespace whirl::regression {
namespace {

/// Lower Cholesky factor of g on a growing and shrinking active set.
class ActiveFactor {
 public:
  ActiveFactor(const Eigen::MatrixXd& g, Eigen::Index capacity) : g_(g), l_(capacity, capacity) {}

  /// False when the column is, within rounding, a combination of the active ones.
  bool add(int j) {
    const Eigen::Index k = static_cast<Eigen::Index>(active_.size());
    Eigen::VectorXd row(k);
    for (Eigen::Index i = 0; i < k; ++i) row[i] = g_(j, active_[static_cast<std::size_t>(i)]);
    l_.topLeftCorner(k, k).triangularView<Eigen::Lower>().solveInPlace(row);
    const double pivot = g_(j, j) - row.squaredNorm();
    if (pivot <= 1e-13 * g_(j, j)) return false;
    l_.row(k).head(k) = row.transpose();
    l_(k, k) = std::sqrt(pivot);
    active_.push_back(j);
    return true;
  }
  void remove(std::size_t position) {
    std::vector<int> rest(active_.begin() + static_cast<std::ptrdiff_t>(position) + 1, active_.end());
    active_.resize(position);
    for (int j : rest) add(j);
  }
  Eigen::VectorXd solve(Eigen::VectorXd b) const {
    const Eigen::Index k = b.size();
    const auto l = l_.topLeftCorner(k, k).triangularView<Eigen::Lower>();
    l.solveInPlace(b);
    l.transpose().solveInPlace(b);
    return b;
  }
  const std::vector<int>& active() const { return active_; }

 private:
  const Eigen::MatrixXd& g_;
  Eigen::MatrixXd l_;
  std::vector<int> active_;
};

}  // namespace

std::vector<LassoKnot> lasso_path(const Eigen::MatrixXd& g, const Eigen::VectorXd& c, double alpha_end,
                                  const std::vector<int>& keep, const std::vector<int>& sign) {
  const Eigen::Index q = c.size();
  std::vector<char> blocked(static_cast<std::size_t>(q), 0), active(static_cast<std::size_t>(q), 0),
      unpenalised(static_cast<std::size_t>(q), 0);
  ActiveFactor factor(g, q);
  const auto bound = [&](Eigen::Index j) { return sign.empty() ? 0 : sign[static_cast<std::size_t>(j)]; };
  for (Eigen::Index j = 0; j < q; ++j) blocked[static_cast<std::size_t>(j)] = !(g(j, j) > 0);
  for (int j : keep) {
    unpenalised[static_cast<std::size_t>(j)] = 1;
    if (!blocked[static_cast<std::size_t>(j)] && factor.add(j)) {
      active[static_cast<std::size_t>(j)] = 1;
    } else {
      blocked[static_cast<std::size_t>(j)] = 1;
    }
  }
  Eigen::VectorXd w = Eigen::VectorXd::Zero(q);
  if (!factor.active().empty()) w(factor.active()) = factor.solve(c(factor.active()));
  Eigen::VectorXd correlation = c - g * w;
  const auto may_join = [&](Eigen::Index j, int direction) {
    return !blocked[static_cast<std::size_t>(j)] && !active[static_cast<std::size_t>(j)] &&
           !unpenalised[static_cast<std::size_t>(j)] && bound(j) * direction >= 0;
  };

  double alpha = 0;
  int joining = -1;
  for (Eigen::Index j = 0; j < q; ++j) {
    for (int direction : {1, -1}) {
      if (may_join(j, direction) && direction * correlation[j] > alpha) {
        alpha = direction * correlation[j];
        joining = static_cast<int>(j);
      }
    }
  }
  std::vector<int> s(static_cast<std::size_t>(q), 0);  // sign of active penalised terms
  std::vector<LassoKnot> path{{alpha, w}};
  int just_left = -1;
  for (Eigen::Index step = 0; step < 20 * q + 50 && alpha > alpha_end; ++step) {
    if (joining >= 0) {
      const std::size_t j = static_cast<std::size_t>(joining);
      if (factor.add(joining)) {
        active[j] = 1;
        s[j] = correlation[joining] > 0 ? 1 : -1;
      } else {
        blocked[j] = 1;
      }
    }
    const std::vector<int>& a = factor.active();
    Eigen::VectorXd direction_full = Eigen::VectorXd::Zero(q);
    if (!a.empty()) {
      Eigen::VectorXd signs(static_cast<Eigen::Index>(a.size()));
      for (std::size_t k = 0; k < a.size(); ++k)
        signs[static_cast<Eigen::Index>(k)] = s[static_cast<std::size_t>(a[k])];
      direction_full(a) = factor.solve(signs);
    }
    const Eigen::VectorXd slope = g * direction_full;
    double t = alpha - alpha_end;
    joining = -1;
    int leaving = -1;
    for (Eigen::Index j = 0; j < q; ++j) {
      for (int direction : {1, -1}) {
        if (!may_join(j, direction)) continue;
        // direction * (corr - t slope) = alpha - t
        const double closing = 1 - direction * slope[j];
        const double gap = alpha - direction * correlation[j];
        // A term that has just left sits at the bound on its old side and moves inwards.
        if (static_cast<int>(j) == just_left && gap <= 1e-12 * alpha) continue;
        if (closing > 1e-14 && std::max(gap, 0.0) / closing < t) {
          t = std::max(gap, 0.0) / closing;
          joining = static_cast<int>(j);
          leaving = -1;
        }
      }
    }
    for (std::size_t k = 0; k < a.size(); ++k) {
      const int j = a[k];
      if (unpenalised[static_cast<std::size_t>(j)] || direction_full[j] * w[j] >= 0) continue;
      const double crossing = -w[j] / direction_full[j];
      if (crossing < t) {
        t = crossing;
        joining = -1;
        leaving = static_cast<int>(k);
      }
    }
    w += t * direction_full;
    alpha -= t;
    just_left = -1;
    if (leaving >= 0) {
      const int j = a[static_cast<std::size_t>(leaving)];
      w[j] = 0;
      active[static_cast<std::size_t>(j)] = 0;
      s[static_cast<std::size_t>(j)] = 0;
      just_left = j;
      factor.remove(static_cast<std::size_t>(leaving));
      // A column blocked by the one that left may be independent now.
      for (Eigen::Index i = 0; i < q; ++i) {
        if (g(i, i) > 0 && !unpenalised[static_cast<std::size_t>(i)]) blocked[static_cast<std::size_t>(i)] = 0;
      }
    }
    correlation = c - g * w;
    path.push_back({alpha, w});
    if (joining < 0 && leaving < 0) break;
  }
  return path;
}

namespace detail {

double lasso_alpha_max(const Scaled& s) {
  const Eigen::VectorXd w = least_squares(s, s.keep);
  const Eigen::VectorXd correlation = s.c - s.g * w;
  double alpha = 0;
  for (int j : s.candidates) {
    const int sign = s.sign[static_cast<std::size_t>(j)];
    alpha = std::max(alpha, sign == 0 ? std::abs(correlation[j]) : sign * correlation[j]);
  }
  return alpha;
}

std::vector<double> lasso_grid(double alpha_max, const SolveOptions& o) {
  const bool exact = o.method != "lasso_cd";
  const double floor = o.path_floor > 0 ? o.path_floor : exact ? 1e-6 : 1e-4;
  std::vector<double> grid;
  const int n = std::max(o.path_points, 2);
  for (int i = 0; i < n; ++i) grid.push_back(alpha_max * std::pow(floor, static_cast<double>(i) / (n - 1)));
  if (exact && o.path_floor <= 0) grid.push_back(0);  // the exact path ends in least squares
  return grid;
}

namespace {

std::vector<Eigen::VectorXd> by_homotopy(const Scaled& s, const std::vector<double>& grid) {
  const std::vector<LassoKnot> knots = lasso_path(s.g, s.c, grid.back(), s.keep, s.sign);
  std::vector<Eigen::VectorXd> out;
  std::size_t k = 0;
  for (double alpha : grid) {
    while (k + 1 < knots.size() && knots[k + 1].alpha > alpha) ++k;
    if (alpha >= knots[0].alpha || k + 1 >= knots.size()) {
      out.push_back(alpha >= knots[0].alpha ? knots[0].xi : knots.back().xi);
      continue;
    }
    const LassoKnot &a = knots[k], &b = knots[k + 1];
    const double share = a.alpha > b.alpha ? (a.alpha - alpha) / (a.alpha - b.alpha) : 1;
    out.push_back(a.xi + share * (b.xi - a.xi));
  }
  return out;
}

std::vector<Eigen::VectorXd> by_coordinate_descent(const Scaled& s, const std::vector<double>& grid) {
  std::vector<Eigen::VectorXd> out;
  const std::vector<int> all = all_terms(s);
  std::vector<char> kept(static_cast<std::size_t>(s.size()), 0);
  for (int j : s.keep) kept[static_cast<std::size_t>(j)] = 1;
  Eigen::VectorXd w = least_squares(s, s.keep);
  Eigen::VectorXd correlation = s.c - s.g * w;
  for (double alpha : grid) {
    for (int sweep = 0; sweep < 5000; ++sweep) {
      double largest = 0;
      for (int j : all) {
        const std::size_t i = static_cast<std::size_t>(j);
        const double z = correlation[j] + s.g(j, j) * w[j];
        double next = kept[i] ? z : std::copysign(std::max(std::abs(z) - alpha, 0.0), z);
        if (s.sign[i] * next < 0) next = 0;
        next /= s.g(j, j);
        const double change = next - w[j];
        if (change == 0) continue;
        w[j] = next;
        correlation -= change * s.g.col(j);
        largest = std::max(largest, std::abs(change));
      }
      if (largest < 1e-10) break;
    }
    out.push_back(w);
  }
  return out;
}

double normal_quantile(double p) {
  // Bisection on erfc: called once per fit.
  double low = -40, high = 40;
  for (int i = 0; i < 200; ++i) {
    const double mid = 0.5 * (low + high);
    (0.5 * std::erfc(-mid / std::sqrt(2.0)) < p ? low : high) = mid;
  }
  return 0.5 * (low + high);
}

}  // namespace

std::vector<Eigen::VectorXd> lasso_at(const Scaled& s, const std::vector<double>& grid, bool coordinate_descent) {
  return coordinate_descent ? by_coordinate_descent(s, grid) : by_homotopy(s, grid);
}

Eigen::VectorXd sqrt_lasso(const Scaled& s, const SolveOptions& o, double& parameter) {
  const double alpha_max = lasso_alpha_max(s);
  const double sigma_max = std::sqrt(s.rss(least_squares(s, s.keep)));
  const double lambda_max = sigma_max > 0 ? alpha_max / sigma_max : 0;
  const double q = static_cast<double>(s.candidates.size());
  const double lambda = o.lambda >= 0 ? o.lambda * lambda_max
                                      : 1.1 * normal_quantile(1 - 0.05 / (2 * std::max(q, 1.0))) / std::sqrt(s.rows);
  parameter = lambda_max > 0 ? lambda / lambda_max : 1;
  const std::vector<LassoKnot> knots = lasso_path(s.g, s.c, 0, s.keep, s.sign);
  // alpha / sigma(alpha) falls along the path; the optimum has alpha = lambda sigma(alpha).
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    if (knots[k + 1].alpha > lambda * std::sqrt(s.rss(knots[k + 1].xi))) continue;
    double low = 0, high = 1;
    const LassoKnot &a = knots[k], &b = knots[k + 1];
    for (int i = 0; i < 60; ++i) {
      const double mid = 0.5 * (low + high);
      const Eigen::VectorXd w = a.xi + mid * (b.xi - a.xi);
      const double alpha = a.alpha + mid * (b.alpha - a.alpha);
      (alpha > lambda * std::sqrt(s.rss(w)) ? low : high) = mid;
    }
    return a.xi + low * (b.xi - a.xi);
  }
  return knots.back().xi;
}

Path lspl(const Scaled& s) {
  Path path;
  const std::vector<LassoKnot> knots = lasso_path(s.g, s.c, 0, s.keep, s.sign);
  std::vector<std::vector<int>> seen;
  for (const LassoKnot& k : knots) {
    std::vector<int> support = support_of(k.xi);
    if (std::find(seen.begin(), seen.end(), support) != seen.end()) continue;
    path.parameter.push_back(knots[0].alpha > 0 ? k.alpha / knots[0].alpha : 0);
    path.w.push_back(least_squares(s, support));
    seen.push_back(std::move(support));
  }
  return path;
}

}  // namespace detail
}  // namespace whirl::regression
