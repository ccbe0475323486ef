// Exact best subset of every size: branch and bound on triangular factors.
#include <algorithm>
#include <cmath>
#include <limits>

#include "scaled.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::regression::detail {
namespace {

/// Columns in the order of `order`, of which the first `fixed` belong to every model below the node. r is the block
/// behind them of the upper factor of [g c; c' 1] in that order, so the residual of the first j columns is the squared
/// tail of its last column from row j - fixed on.
struct Node {
  std::vector<int> order;
  Eigen::MatrixXd r;
  std::size_t fixed = 0;
};

class Search {
 public:
  Search(const Scaled& s, std::size_t terms, std::size_t max_terms, bool winners_only)
      : s_(s),
        winners_only_(winners_only),
        bounded_(std::any_of(s.sign.begin(), s.sign.end(), [](int sign) { return sign != 0; })),
        max_(max_terms),
        rss_(terms + 1, std::numeric_limits<double>::infinity()),
        best_(terms + 1) {}

  /// `rss` without sign bounds: they can only raise it.
  void offer(std::size_t size, double rss, const std::vector<int>& order) {
    if (rss >= rss_[size]) return;
    if (bounded_) {
      rss = residual(order, size);
      if (rss >= rss_[size]) return;
    }
    rss_[size] = rss;
    if (const double value = bic(s_, rss, static_cast<int>(size)); value < lowest_bic_) {
      lowest_bic_ = value;
      winner_ = size;
    }
    best_[size].assign(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(size));
  }

  void visit(const Node& node) {
    const std::size_t n = node.order.size();
    const Eigen::Index last = node.r.cols() - 1;
    double tail = node.r(last, last) * node.r(last, last);
    const double bound = bounded_ ? residual(node.order, n) : tail;
    for (std::size_t size = n;; --size) {
      offer(size, tail, node.order);
      if (size <= node.fixed) break;
      const Eigen::Index i = static_cast<Eigen::Index>(size - node.fixed) - 1;
      tail += node.r(i, last) * node.r(i, last);
    }
    // Dropping column p leaves models of p + 1 .. n - 1 terms that contain the p columns before it; none of them has a
    // residual below this node's.
    for (std::size_t p = node.fixed; p + 1 < n && p < max_; ++p) {
      if (bound >= rss_[p + 1] || cannot_win(p + 1, bound)) break;
      visit(drop(node, p));
    }
  }

  const std::vector<std::vector<int>>& best() const { return best_; }

 private:
  /// Of the first `size` columns within their sign bounds.
  double residual(const std::vector<int>& order, std::size_t size) const {
    return s_.rss(least_squares(s_, {order.begin(), order.begin() + static_cast<std::ptrdiff_t>(size)})) + 1e-14;
  }
  /// No model of `size` terms or more with a residual of at least `bound` has the lowest criterion.
  bool cannot_win(std::size_t size, double bound) const {
    return winners_only_ && size > winner_ && bic(s_, bound, static_cast<int>(size)) > lowest_bic_;
  }
  static Node drop(const Node& node, std::size_t p) {
    Node child;
    child.fixed = p;
    child.order = node.order;
    child.order.erase(child.order.begin() + static_cast<std::ptrdiff_t>(p));
    const Eigen::Index first = static_cast<Eigen::Index>(p - node.fixed), n = node.r.cols() - first;
    Eigen::MatrixXd r = node.r.block(first, first + 1, n, n - 1);
    for (Eigen::Index i = 0; i < n - 1; ++i) {  // rows i, i+1 rotate the subdiagonal away
      const double a = r(i, i), b = r(i + 1, i);
      const double h = std::sqrt(a * a + b * b);
      if (h == 0) continue;
      const double cos = a / h, sin = b / h;
      for (Eigen::Index j = i; j < n - 1; ++j) {
        const double u = r(i, j), v = r(i + 1, j);
        r(i, j) = cos * u + sin * v;
        r(i + 1, j) = cos * v - sin * u;
      }
    }
    child.r = r.topRows(n - 1);
    return child;
  }

  const Scaled& s_;
  bool winners_only_;
  std::size_t winner_ = 0;  // size of the model with the lowest criterion so far
  double lowest_bic_ = std::numeric_limits<double>::infinity();
  bool bounded_;
  std::size_t max_;
  std::vector<double> rss_;
  std::vector<std::vector<int>> best_;
};

}  // namespace

Path best_subset(const Scaled& s, int max_terms, bool winners_only) {
  Path path;
  Node root;
  root.order = s.keep;
  // Strong terms first: they stay in most good models, so that weak branches are cut early.
  const std::vector<int> order = importance_order(s);
  root.order.insert(root.order.end(), order.begin(), order.end());
  root.fixed = s.keep.size();
  const std::size_t n = root.order.size();
  const Eigen::Index m = static_cast<Eigen::Index>(n);
  Eigen::MatrixXd augmented(m + 1, m + 1);
  augmented.topLeftCorner(m, m) = s.g(root.order, root.order);
  augmented.topRightCorner(m, 1) = s.c(root.order);
  augmented.bottomLeftCorner(1, m) = s.c(root.order).transpose();
  augmented(m, m) = 1;
  // Exactly dependent columns would stop the factorisation; this much is below any residual that means anything.
  augmented.diagonal().head(m).array() += 1e-15;
  augmented(m, m) += 1e-14;
  const Eigen::LLT<Eigen::MatrixXd> factor(augmented);
  if (factor.info() != Eigen::Success) return frols(s, max_terms);
  const Eigen::MatrixXd upper = factor.matrixU();
  const Eigen::Index behind = m + 1 - static_cast<Eigen::Index>(root.fixed);
  root.r = upper.bottomRightCorner(behind, behind);
  const std::size_t limit = max_terms > 0 ? std::min(n, static_cast<std::size_t>(max_terms)) : n;
  Search search(s, n, limit, winners_only);
  // Good models to start with cut the tree from the beginning.
  const Path forward = frols(s, static_cast<int>(limit));
  for (const Eigen::VectorXd& w : forward.w) {
    const std::vector<int> support = support_of(w);
    search.offer(support.size(), s.rss(w) + 1e-14, support);
  }
  search.visit(root);
  for (std::size_t size = root.fixed; size <= limit; ++size) {
    std::vector<int> support = search.best()[size];
    if (support.size() != size) continue;
    std::sort(support.begin(), support.end());
    path.w.push_back(least_squares(s, support));
    path.parameter.push_back(static_cast<double>(size));
  }
  return path;
}

}  // namespace whirl::regression::detail
