// Exact lasso path by homotopy, coordinate descent, square-root lasso, LSPL.
#include <algorithm>
#include <cmath>
#include <limits>

#include "scaled.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::regression {
namespace {

using Eigen::Index;

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

/// The path between two knots: which terms are in, and what happens next as the penalty falls.
class Homotopy {
 public:
  Homotopy(const Eigen::MatrixXd& g, const Eigen::VectorXd& c, const std::vector<int>& keep,
           const std::vector<int>& sign)
      : g_(g), c_(c), bounds_(sign), factor_(g, c.size()), terms_(static_cast<std::size_t>(c.size())) {
    for (Index j = 0; j < c.size(); ++j) at(j).blocked = !(g(j, j) > 0);
    for (int j : keep) {
      at(j).unpenalised = true;
      if (!at(j).blocked && factor_.add(j)) {
        at(j).active = true;
      } else {
        at(j).blocked = true;
      }
    }
    w_ = Eigen::VectorXd::Zero(c.size());
    if (!factor_.active().empty()) w_(factor_.active()) = factor_.solve(c(factor_.active()));
    correlation_ = c - g * w_;
  }

  std::vector<LassoKnot> run(double alpha_end) {
    Event event = first_to_join();
    alpha_ = event.alpha;
    std::vector<LassoKnot> path{{alpha_, w_}};
    for (Index step = 0; step < 20 * c_.size() + 50 && alpha_ > alpha_end; ++step) {
      if (event.joining >= 0) join(event.joining);
      const Eigen::VectorXd direction = direction_of_w();
      event = next(direction, alpha_ - alpha_end);
      w_ += event.alpha * direction;
      alpha_ -= event.alpha;
      just_left_ = -1;
      if (event.leaving >= 0) leave(event.leaving);
      correlation_ = c_ - g_ * w_;
      path.push_back({alpha_, w_});
      if (event.joining < 0 && event.leaving < 0) break;
    }
    return path;
  }

 private:
  struct Term {
    bool blocked = false, active = false, unpenalised = false;
    int sign = 0;  ///< of an active penalised term
  };
  struct Event {
    double alpha;      ///< penalty at the start, afterwards the step down to the event
    int joining = -1;  ///< the term
    int leaving = -1;  ///< its place among the active ones
  };
  Term& at(Index j) { return terms_[static_cast<std::size_t>(j)]; }
  const Term& at(Index j) const { return terms_[static_cast<std::size_t>(j)]; }

  bool may_join(Index j, int direction) const {
    const int bound = bounds_.empty() ? 0 : bounds_[static_cast<std::size_t>(j)];
    return !at(j).blocked && !at(j).active && !at(j).unpenalised && bound * direction >= 0;
  }

  Event first_to_join() const {
    Event first{0};
    for (Index j = 0; j < c_.size(); ++j) {
      for (int direction : {1, -1}) {
        if (may_join(j, direction) && direction * correlation_[j] > first.alpha) {
          first = {direction * correlation_[j], static_cast<int>(j)};
        }
      }
    }
    return first;
  }

  void join(int j) {
    if (factor_.add(j)) {
      at(j).active = true;
      at(j).sign = correlation_[j] > 0 ? 1 : -1;
    } else {
      at(j).blocked = true;
    }
  }

  Eigen::VectorXd direction_of_w() const {
    const std::vector<int>& a = factor_.active();
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(c_.size());
    if (a.empty()) return direction;
    Eigen::VectorXd signs(static_cast<Index>(a.size()));
    for (std::size_t k = 0; k < a.size(); ++k) signs[static_cast<Index>(k)] = at(a[k]).sign;
    direction(a) = factor_.solve(signs);
    return direction;
  }

  /// What happens first within a step of `longest`: a term joins, an active one crosses zero, or nothing.
  Event next(const Eigen::VectorXd& direction_of_w, double longest) const {
    const Eigen::VectorXd slope = g_ * direction_of_w;
    Event event{longest};
    for (Index j = 0; j < c_.size(); ++j) {
      for (int direction : {1, -1}) {
        if (!may_join(j, direction)) continue;
        // direction * (corr - t slope) = alpha - t
        const double closing = 1 - direction * slope[j];
        const double gap = alpha_ - direction * correlation_[j];
        // A term that has just left sits at the bound on its old side and moves inwards.
        if (static_cast<int>(j) == just_left_ && gap <= 1e-12 * alpha_) continue;
        if (closing > 1e-14 && std::max(gap, 0.0) / closing < event.alpha) {
          event = {std::max(gap, 0.0) / closing, static_cast<int>(j)};
        }
      }
    }
    const std::vector<int>& a = factor_.active();
    for (std::size_t k = 0; k < a.size(); ++k) {
      const int j = a[k];
      if (at(j).unpenalised || direction_of_w[j] * w_[j] >= 0) continue;
      const double crossing = -w_[j] / direction_of_w[j];
      if (crossing < event.alpha) event = {crossing, -1, static_cast<int>(k)};
    }
    return event;
  }

  void leave(int place) {
    const int j = factor_.active()[static_cast<std::size_t>(place)];
    w_[j] = 0;
    at(j).active = false;
    at(j).sign = 0;
    just_left_ = j;
    factor_.remove(static_cast<std::size_t>(place));
    // A column blocked by the one that left may be independent now.
    for (Index i = 0; i < c_.size(); ++i) {
      if (g_(i, i) > 0 && !at(i).unpenalised) at(i).blocked = false;
    }
  }

  const Eigen::MatrixXd& g_;
  const Eigen::VectorXd& c_;
  const std::vector<int>& bounds_;
  ActiveFactor factor_;
  std::vector<Term> terms_;
  Eigen::VectorXd w_, correlation_;
  double alpha_ = 0;
  int just_left_ = -1;
};

}  // namespace

std::vector<LassoKnot> lasso_path(const Eigen::MatrixXd& g, const Eigen::VectorXd& c, double alpha_end,
                                  const std::vector<int>& keep, const std::vector<int>& sign) {
  return Homotopy(g, c, keep, sign).run(alpha_end);
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
  const double floor = o.lasso.path_floor > 0 ? o.lasso.path_floor : exact ? 1e-6 : 1e-4;
  std::vector<double> grid;
  const int n = std::max(o.lasso.path_points, 2);
  for (int i = 0; i < n; ++i) grid.push_back(alpha_max * std::pow(floor, static_cast<double>(i) / (n - 1)));
  if (exact && o.lasso.path_floor <= 0) grid.push_back(0);  // the exact path ends in least squares
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
  const double lambda = o.lasso.lambda >= 0
                            ? o.lasso.lambda * lambda_max
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
