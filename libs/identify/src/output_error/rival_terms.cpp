#include "output_error/rival_terms.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "output_error/score.hpp"
#include "whirl/regression/regression.hpp"

namespace whirl::identification::detail {
namespace {

double criterion(double cost, double rows, std::size_t terms) {
  return rows * std::log(cost) + static_cast<double>(terms) * std::log(rows);
}

double cost_of(const TermCost& c, const std::vector<int>& terms, const Eigen::VectorXd& xi) {
  return c.energy - 2 * c.moment(terms).dot(xi) + xi.dot(c.information(terms, terms) * xi);
}

/// The best set of every size up to `most` without term `left_out`.
std::vector<TermSet> best_sets(const TermCost& c, int left_out, int most) {
  std::vector<int> columns;
  for (int j = 0; j < static_cast<int>(c.moment.size()); ++j) {
    if (j != left_out && c.information(j, j) > 0) columns.push_back(j);
  }
  regression::Problem problem;
  problem.total = {c.information(columns, columns), c.moment(columns), c.energy, c.rows};
  problem.effective_rows = c.rows;
  // Not bic: every size is needed, not only those that could have the lowest.
  regression::SolveOptions options{.method = "best_subset", .selection = regression::Selection::aic, .max_terms = most};
  if (!c.sign.empty()) {
    for (int j : columns) options.rules.sign.push_back(c.sign[static_cast<std::size_t>(j)]);
  }
  std::vector<TermSet> sets;
  for (const regression::PathPoint& point : regression::solve(problem, options).path) {
    TermSet set;
    std::vector<double> values;
    for (Eigen::Index j = 0; j < point.xi.size(); ++j) {
      if (point.xi[j] == 0) continue;
      set.terms.push_back(columns[static_cast<std::size_t>(j)]);
      values.push_back(point.xi[j]);
    }
    set.xi = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
    if (!set.terms.empty()) sets.push_back(std::move(set));
  }
  return sets;
}

}  // namespace

TermCost term_cost(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient, const std::vector<int>& own,
                   const std::vector<int>& others, const Eigen::VectorXd& xi, double cost, double rows) {
  const Remainder left = remainders(normal, gradient, others, {own}).front();
  const Eigen::VectorXd here = xi(own);
  const Eigen::VectorXd turned = left.information * here;
  return {left.information, left.gradient + turned, cost + 2 * left.gradient.dot(here) + here.dot(turned), rows, {}};
}

std::vector<TermSet> rival_sets(const TermCost& cost, const std::vector<int>& present, double margin) {
  // Below this share of the energy a cost is rounding of the sums: such records tell their terms anyway.
  constexpr double kRounding = 1e-11;
  const Eigen::VectorXd own =
      Eigen::MatrixXd(cost.information(present, present)).ldlt().solve(Eigen::VectorXd(cost.moment(present)));
  const double left = cost_of(cost, present, own);
  std::vector<TermSet> rivals;
  if (!(left > kRounding * cost.energy)) return rivals;
  const double now = criterion(left, cost.rows, present.size());
  for (int out : present) {
    for (TermSet& set : best_sets(cost, out, static_cast<int>(present.size()) + 1)) {
      const double its = cost_of(cost, set.terms, set.xi);
      if (!(its > 0) || std::includes(present.begin(), present.end(), set.terms.begin(), set.terms.end())) continue;
      set.excess = criterion(its, cost.rows, set.terms.size()) - now;
      const bool known =
          std::any_of(rivals.begin(), rivals.end(), [&](const TermSet& r) { return r.terms == set.terms; });
      if (set.excess <= margin && !known) rivals.push_back(std::move(set));
    }
  }
  std::sort(rivals.begin(), rivals.end(), [](const TermSet& a, const TermSet& b) { return a.excess < b.excess; });
  return rivals;
}

}  // namespace whirl::identification::detail
