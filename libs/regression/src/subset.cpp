// Methods that work on supports: thresholding, stepwise, forward, backward.
#include <algorithm>
#include <cmath>
#include <limits>

#include "scaled.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::regression::detail {

Eigen::VectorXd stlsq(const Scaled& s, const SolveOptions& o) {
  std::vector<int> candidates = s.candidates;
  while (true) {
    std::vector<int> support = candidates;
    support.insert(support.end(), s.keep.begin(), s.keep.end());
    std::sort(support.begin(), support.end());
    const Eigen::VectorXd w = least_squares(s, support, o.ridge);
    std::vector<int> next;
    for (int j : candidates) {
      if (std::abs(w[j]) >= o.threshold && w[j] != 0) next.push_back(j);
    }
    if (next.size() == candidates.size()) return w;
    candidates = std::move(next);
  }
}

Eigen::VectorXd sr3(const Scaled& s, const SolveOptions& o, bool l1) {
  const Eigen::Index q = s.size();
  Eigen::MatrixXd m = s.g;
  m.diagonal().array() += 1 / o.sr3_nu;
  const Eigen::LLT<Eigen::MatrixXd> factor(m);
  std::vector<char> kept(static_cast<std::size_t>(q), 0);
  for (int j : s.keep) kept[static_cast<std::size_t>(j)] = 1;
  Eigen::VectorXd u = least_squares(s, all_terms(s));
  for (int it = 0; it < 20000; ++it) {
    Eigen::VectorXd w = factor.solve(s.c + u / o.sr3_nu);
    for (Eigen::Index j = 0; j < q; ++j) {
      const std::size_t i = static_cast<std::size_t>(j);
      if (s.sign[i] * w[j] < 0) w[j] = 0;
      if (kept[i]) continue;
      if (l1) {
        w[j] = std::copysign(std::max(std::abs(w[j]) - o.threshold, 0.0), w[j]);
      } else if (std::abs(w[j]) < o.threshold) {
        w[j] = 0;
      }
    }
    const double change = (w - u).cwiseAbs().maxCoeff();
    u = std::move(w);
    if (change < 1e-10) break;
  }
  std::vector<int> support = support_of(u);
  for (int j : s.keep) {
    if (u[j] == 0) support.push_back(j);
  }
  std::sort(support.begin(), support.end());
  return least_squares(s, support);
}

namespace {
/// t value of every term of a support for rows of equal, independent noise.
Eigen::VectorXd t_values(const Scaled& s, const std::vector<int>& support, const Eigen::VectorXd& w) {
  const Eigen::Index k = static_cast<Eigen::Index>(support.size());
  const Eigen::MatrixXd g = s.g(support, support);
  const Eigen::MatrixXd inverse = g.ldlt().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(k, k)));
  const double freedom = std::max(1.0, s.rows - static_cast<double>(k));
  const double variance = std::max(s.rss(w), 1e-16) / freedom;
  Eigen::VectorXd t(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    t[i] = w[support[static_cast<std::size_t>(i)]] / std::sqrt(variance * std::max(inverse(i, i), 1e-300));
  }
  return t;
}

/// Drops one candidate at a time until `stop`; `weight` gives what each candidate of a support is worth.
template <class Weight, class Visit>
void eliminate_stepwise(const Scaled& s, Weight weight, Visit visit) {
  std::vector<int> support = all_terms(s);
  std::vector<char> kept(static_cast<std::size_t>(s.size()), 0);
  for (int j : s.keep) kept[static_cast<std::size_t>(j)] = 1;
  while (true) {
    const Eigen::VectorXd w = least_squares(s, support);
    const Eigen::VectorXd worth = weight(support, w);
    double least = std::numeric_limits<double>::infinity();
    std::size_t position = support.size();
    for (std::size_t k = 0; k < support.size(); ++k) {
      if (kept[static_cast<std::size_t>(support[k])]) continue;
      const double v = std::abs(worth[static_cast<Eigen::Index>(k)]);
      if (!(v >= least)) {
        least = v;
        position = k;
      }
    }
    if (!visit(w, least, position < support.size() ? support[position] : -1) || position == support.size()) return;
    support.erase(support.begin() + static_cast<std::ptrdiff_t>(position));
  }
}
}  // namespace

Eigen::VectorXd backward(const Scaled& s, const SolveOptions& o) {
  Eigen::VectorXd result;
  eliminate_stepwise(
      s, [&](const std::vector<int>& support, const Eigen::VectorXd& w) { return t_values(s, support, w); },
      [&](const Eigen::VectorXd& w, double least, int) {
        result = w;
        return least < o.t_value;
      });
  return result;
}

std::vector<int> importance_order(const Scaled& s) {
  std::vector<int> order;
  eliminate_stepwise(
      s, [&](const std::vector<int>& support, const Eigen::VectorXd& w) { return t_values(s, support, w); },
      [&](const Eigen::VectorXd&, double, int j) {
        if (j >= 0) order.push_back(j);
        return true;
      });
  std::reverse(order.begin(), order.end());
  return order;
}

Path ssr(const Scaled& s) {
  Path path;
  eliminate_stepwise(
      s, [](const std::vector<int>& support, const Eigen::VectorXd& w) { return Eigen::VectorXd(w(support)); },
      [&](const Eigen::VectorXd& w, double, int) {
        path.w.push_back(w);
        path.parameter.push_back(static_cast<double>(support_of(w).size()));
        return true;
      });
  return path;
}

Path frols(const Scaled& s, int max_terms) {
  Path path;
  // Gauss-Jordan sweeps keep g(j,j) and c(j) as what remains of column j after the chosen ones are projected out.
  Eigen::MatrixXd g = s.g;
  Eigen::VectorXd c = s.c;
  std::vector<int> support;
  std::vector<int> left = s.candidates;
  const auto sweep = [&](int j) {
    const Eigen::VectorXd column = g.col(j) / std::sqrt(g(j, j));
    const double moment = c[j] / std::sqrt(g(j, j));
    g.noalias() -= column * column.transpose();
    c -= moment * column;
    support.push_back(j);
  };
  const auto record = [&] {
    std::vector<int> sorted = support;
    std::sort(sorted.begin(), sorted.end());
    path.w.push_back(least_squares(s, sorted));
    path.parameter.push_back(static_cast<double>(sorted.size()));
  };
  for (int j : s.keep) {
    if (g(j, j) > 1e-13) sweep(j);
  }
  record();
  const std::size_t limit = max_terms > 0 ? static_cast<std::size_t>(max_terms) : s.candidates.size() + s.keep.size();
  while (!left.empty() && support.size() < limit) {
    double best = 0;
    int chosen = -1;
    for (int j : left) {
      if (g(j, j) < 1e-13) continue;
      const double reduction = c[j] * c[j] / g(j, j);
      if (reduction > best) {
        best = reduction;
        chosen = j;
      }
    }
    if (chosen < 0) break;
    sweep(chosen);
    std::erase(left, chosen);
    record();
  }
  return path;
}

}  // namespace whirl::regression::detail
