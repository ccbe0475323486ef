#include "relations.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/core/least_squares.hpp"

namespace whirl::lagrange {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd RelationProblem::scale(const VectorXd& p) const {
  VectorXd scale = p.cwiseAbs();
  for (Index k = 0; k < p.size(); ++k) {
    if (is_angle(k) || p[k] == 0) scale[k] = 1;
  }
  return scale;
}

MatrixXd minimal_norm(const MatrixXd& a, const MatrixXd& b) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(a).solve(b);
}

namespace {

/// Start: the logarithms of the products of powers among the relations form a linear system in log|p|; functions and
/// sums in them are taken at the values that p already has.
VectorXd start(const RelationProblem& problem, VectorXd p) {
  const Index n = p.size(), m = problem.observed.size();
  MatrixXd a = MatrixXd::Zero(m, n);
  MatrixXd b = MatrixXd::Zero(m, 1);
  std::map<std::string, double, std::less<>> values;
  for (Index k = 0; k < n; ++k) values[problem.names[static_cast<std::size_t>(k)]] = p[k];
  for (Index r = 0; r < m; ++r) {
    const expr::Expr& relation = problem.relations[static_cast<std::size_t>(r)];
    double rest = 1;
    for (const expr::Expr& factor :
         relation.kind() == expr::Expr::Kind::product ? relation.args() : std::vector<expr::Expr>{relation}) {
      const bool power = factor.kind() == expr::Expr::Kind::power &&
                         factor.args()[0].kind() == expr::Expr::Kind::symbol && factor.args()[1].is_number();
      const expr::Expr& base = power ? factor.args()[0] : factor;
      const auto name = base.kind() == expr::Expr::Kind::symbol
                            ? std::find(problem.names.begin(), problem.names.end(), base.name())
                            : problem.names.end();
      if (name == problem.names.end()) {
        rest *= evaluate(factor, values);
      } else {
        a(r, name - problem.names.begin()) += power ? factor.args()[1].value() : 1.0;
      }
    }
    const double ratio = std::abs(problem.observed[r] / rest);
    if (ratio > 0 && std::isfinite(ratio)) {
      b(r, 0) = std::log(ratio);
    } else {
      a.row(r).setZero();
    }
  }
  const VectorXd log = minimal_norm(a, b);
  for (Index k = 0; k < n; ++k) {
    if (!a.col(k).isZero()) p[k] = std::copysign(std::exp(std::clamp(log[k], -100.0, 100.0)), p[k]);
  }
  return p;
}

/// The relations to the descent: steps in units of each parameter's own size.
struct Misfit {
  const RelationProblem& problem;
  const Relations& relations;

  void linearise(const VectorXd& p, SquareSum& sum) const {
    VectorXd value;
    MatrixXd jacobian;
    relations.evaluate(p, value, jacobian);
    const VectorXd r = problem.whitening * (problem.observed - value);
    const MatrixXd j = problem.whitening * jacobian * problem.scale(p).asDiagonal();
    sum = {r.squaredNorm(), j.transpose() * j, j.transpose() * r};
    if (!sum.normal.allFinite() || !sum.gradient.allFinite()) sum.cost = std::numeric_limits<double>::infinity();
  }
  void last(const VectorXd& p, SquareSum& sum) const { linearise(p, sum); }
  VectorXd moved(const VectorXd& p, const VectorXd& step) const { return p + problem.scale(p).cwiseProduct(step); }
  bool small(const SquareSum& sum, const VectorXd& step, double decrease) const {
    return decrease <= 1e-14 * sum.cost && step.norm() <= 1e-12;
  }
};

RelationSolution minimise(const RelationProblem& problem, const Relations& relations, VectorXd p) {
  Misfit misfit{problem, relations};
  SquareSum sum;
  misfit.linearise(p, sum);
  descend(misfit, p, sum, 400);
  VectorXd value;
  RelationSolution found{p, {}, sum.cost};
  relations.evaluate(p, value, found.jacobian);
  return found;
}

}  // namespace

RelationSolution solve(const RelationProblem& problem, const Relations& relations) {
  const Index n = static_cast<Index>(problem.names.size());
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  RelationSolution best;
  int best_negative = 0;
  for (int trial = 0; trial < 60; ++trial) {
    VectorXd p(n);
    for (Index k = 0; k < n; ++k) {
      p[k] = problem.is_angle(k) ? 3.1 * uniform(random) : std::exp(trial == 0 ? 0.0 : 2 * uniform(random));
      // Positive numbers first, then any signs.
      if (trial >= 20 && !problem.is_angle(k) && uniform(random) < 0) p[k] = -p[k];
    }
    const RelationSolution found = minimise(problem, relations, start(problem, p));
    int negative = 0;
    for (Index k = 0; k < n; ++k) negative += !problem.is_angle(k) && found.p[k] < 0;
    const bool equal = std::abs(found.chi_square - best.chi_square) <= 1e-6 * (1 + best.chi_square);
    if (trial == 0 || (equal ? negative < best_negative : found.chi_square < best.chi_square)) {
      best = found;
      best_negative = negative;
    }
    if (trial >= 5 && trial < 20 && best_negative == 0 && best.chi_square < 1e-6) break;
  }
  for (Index k = 0; k < n; ++k) {
    if (problem.is_angle(k)) best.p[k] = std::remainder(best.p[k], 2 * std::numbers::pi);
  }
  return best;
}

MatrixXd whitening(const VectorXd& value, MatrixXd covariance) {
  const double largest = value.cwiseAbs().maxCoeff();
  for (Index i = 0; i < value.size(); ++i) {
    if (std::isfinite(covariance(i, i)) && covariance(i, i) > 0) continue;
    covariance.row(i).setZero();
    covariance.col(i).setZero();
    const double sd = 1e-7 * (value[i] == 0 ? largest : std::abs(value[i]));
    covariance(i, i) = sd > 0 ? sd * sd : 1;
  }
  const VectorXd sd = covariance.diagonal().cwiseSqrt();
  MatrixXd correlation = sd.cwiseInverse().asDiagonal() * covariance * sd.cwiseInverse().asDiagonal();
  correlation.diagonal().array() += 1e-12;
  const Eigen::LLT<MatrixXd> llt(correlation);
  if (llt.info() != Eigen::Success) throw Error("the covariance of the unknowns is not positive definite");
  return llt.matrixL().solve(MatrixXd(sd.cwiseInverse().asDiagonal()));
}

}  // namespace whirl::lagrange
