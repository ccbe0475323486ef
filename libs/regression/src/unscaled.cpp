#include "whirl/regression/unscaled.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "scaled.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::regression {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

std::vector<int> every_term(const GramBlock& sums) {
  std::vector<int> all(static_cast<std::size_t>(sums.terms()));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// Ridge regression on a support. Columns are brought to norm 1 for the solution alone: high monomials would spoil it.
VectorXd ridge_on(const GramBlock& sums, const std::vector<int>& support, const VectorXd& ridge) {
  VectorXd xi = VectorXd::Zero(sums.terms());
  if (support.empty()) return xi;
  Eigen::MatrixXd g = sums.gram(support, support);
  g.diagonal() += VectorXd(ridge(support));
  VectorXd unit = g.diagonal();
  for (Index k = 0; k < unit.size(); ++k) unit[k] = unit[k] > 0 ? 1 / std::sqrt(unit[k]) : 0;
  g = Eigen::MatrixXd(unit.asDiagonal() * g * unit.asDiagonal());
  const VectorXd moment = unit.cwiseProduct(VectorXd(sums.moment(support)));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(g);
  // Directions below rounding carry nothing: of dependent columns the shortest solution is taken.
  const double least = 1e-14 * static_cast<double>(unit.size()) * eigen.eigenvalues().cwiseAbs().maxCoeff();
  VectorXd part = eigen.eigenvectors().transpose() * moment;
  for (Index k = 0; k < part.size(); ++k)
    part[k] = eigen.eigenvalues()[k] > least ? part[k] / eigen.eigenvalues()[k] : 0;
  xi(support) = unit.cwiseProduct(VectorXd(eigen.eigenvectors() * part));
  return xi;
}

struct PathWriter {
  const GramBlock& sums;
  UnscaledPath path = {};

  void add(VectorXd xi) {
    path.mean_square.push_back(sums.residual(xi) / std::max(1.0, sums.rows));
    path.xi.push_back(std::move(xi));
  }
};

UnscaledPath thresholded(const GramBlock& sums, const UnscaledOptions& o) {
  PathWriter out{sums};
  VectorXd ridge = VectorXd::Constant(sums.terms(), o.ridge);
  std::vector<char> kept(static_cast<std::size_t>(sums.terms()), 0);
  for (int j : o.keep) {
    ridge[j] = 0;
    kept[static_cast<std::size_t>(j)] = 1;
  }
  const auto survivors = [&](const VectorXd& xi, const std::vector<int>& of) {
    std::vector<int> next;
    for (int j : of) {
      if (kept[static_cast<std::size_t>(j)] || std::abs(xi[j]) >= o.threshold) next.push_back(j);
    }
    return next;
  };
  std::vector<int> support = every_term(sums);
  if (o.start.size() > 0) support = survivors(o.start, support);
  out.path.converged = false;
  for (int step = 0; step < o.max_iterations && !out.path.converged; ++step) {
    VectorXd xi = ridge_on(sums, support, ridge);
    std::vector<int> next = survivors(xi, support);
    out.path.converged = next.size() == support.size();
    for (int j : support) {
      if (!std::binary_search(next.begin(), next.end(), j)) xi[j] = 0;
    }
    support = std::move(next);
    out.add(std::move(xi));
  }
  return std::move(out.path);
}

double shrunk(double w, double lambda, Penalty penalty, double nu) {
  switch (penalty) {
    case Penalty::l0:
      return std::abs(w) >= std::sqrt(2 * lambda * nu) ? w : 0;
    case Penalty::l1:
      return std::copysign(std::max(std::abs(w) - lambda * nu, 0.0), w);
    case Penalty::l2:
      return w / (1 + 2 * lambda * nu);
  }
  return w;
}

UnscaledPath relaxed(const GramBlock& sums, const UnscaledOptions& o) {
  if (o.weight.size() != sums.terms()) {
    throw Error(fmt::format("{} weights for {} terms: must be as many", o.weight.size(), sums.terms()));
  }
  if (!(o.weight.array() >= 0).all()) throw Error("a weight of sr3 is negative or not a number: must be at least 0");
  PathWriter out{sums};
  Eigen::MatrixXd m = sums.gram;
  m.diagonal().array() += 1 / o.nu;
  const Eigen::LLT<Eigen::MatrixXd> factor(m);
  const VectorXd none = VectorXd::Zero(sums.terms());
  VectorXd u = o.start.size() > 0 ? o.start : ridge_on(sums, every_term(sums), none);
  out.path.converged = false;
  for (int step = 0; step < o.max_iterations && !out.path.converged; ++step) {
    VectorXd next = factor.solve(VectorXd(sums.moment + u / o.nu));
    for (Index j = 0; j < next.size(); ++j) next[j] = shrunk(next[j], o.weight[j], o.penalty, o.nu);
    out.path.converged = (next - u).norm() < o.tolerance;
    u = next;
    out.add(std::move(next));
  }
  return std::move(out.path);
}

UnscaledPath stepwise(const GramBlock& sums, const UnscaledOptions& o) {
  PathWriter out{sums};
  const VectorXd ridge = VectorXd::Constant(sums.terms(), o.ridge);
  std::vector<int> support = every_term(sums);
  out.add(ridge_on(sums, support, ridge));
  for (int step = 0; step < o.max_iterations && support.size() > 1; ++step) {
    double least = std::numeric_limits<double>::infinity();
    std::size_t position = 0;
    for (std::size_t k = 0; k < support.size(); ++k) {
      double worth = std::abs(out.path.xi.back()[support[k]]);
      if (o.by_residual) {
        std::vector<int> without = support;
        without.erase(without.begin() + static_cast<std::ptrdiff_t>(k));
        worth = sums.residual(ridge_on(sums, without, ridge));
      }
      if (worth < least) {
        least = worth;
        position = k;
      }
    }
    support.erase(support.begin() + static_cast<std::ptrdiff_t>(position));
    out.add(ridge_on(sums, support, ridge));
  }
  return std::move(out.path);
}

UnscaledPath forward(const GramBlock& sums, const UnscaledOptions& o) {
  PathWriter out{sums};
  const VectorXd ridge = VectorXd::Constant(sums.terms(), o.ridge);
  // The error reduction ratio does not depend on the units: the choice is that of the scaled method.
  const detail::Path choice = detail::frols(detail::scale(sums, {}, sums.rows), o.max_iterations);
  for (const VectorXd& w : choice.w) {
    const std::vector<int> support = detail::support_of(w);
    if (!support.empty()) out.add(ridge_on(sums, support, ridge));
  }
  if (out.path.xi.empty()) out.add(VectorXd::Zero(sums.terms()));
  return std::move(out.path);
}

void check_unscaled(const GramBlock& sums, const UnscaledOptions& o) {
  require_range("threshold", o.threshold, 0, 1e300);
  require_range("ridge", o.ridge, 0, 1e300);
  require_range("max_iterations", o.max_iterations, 1, 1e9);
  require_range("nu", o.nu, 1e-300, 1e300);
  require_range("tolerance", o.tolerance, 0, 1e300);
  if (sums.gram.rows() != sums.terms() || sums.terms() < 1)
    throw Error("the regression has no terms, or sums of other sizes");
  if (!sums.gram.allFinite() || !sums.moment.allFinite()) {
    throw Error("the sums of the regression are not finite: a column overflows");
  }
  for (int j : o.keep) {
    if (j < 0 || j >= sums.terms()) {
      throw Error::in_field("term to keep", std::to_string(j), fmt::format("0 to {}", sums.terms() - 1));
    }
  }
  if (o.start.size() > 0 && (o.start.size() != sums.terms() || !o.start.allFinite())) {
    throw Error(fmt::format("{} coefficients to start from: must be {} finite numbers", o.start.size(), sums.terms()));
  }
}

}  // namespace

UnscaledPath solve_unscaled(const GramBlock& sums, const UnscaledOptions& o) {
  check_unscaled(sums, o);
  if (o.method == "stlsq") return thresholded(sums, o);
  if (o.method == "sr3") return relaxed(sums, o);
  if (o.method == "ssr") return stepwise(sums, o);
  if (o.method == "frols") return forward(sums, o);
  throw Error::in_field("regression method", o.method, "stlsq, sr3, ssr or frols");
}

}  // namespace whirl::regression
