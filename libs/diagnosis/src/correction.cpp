#include "whirl/diagnosis/correction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "barrier.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/nan.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

Eigen::VectorXd weights(const CorrectionProblem& p) {
  return p.weight.size() > 0 ? p.weight : Eigen::VectorXd::Ones(p.rows());
}
Eigen::VectorXd limits(const CorrectionProblem& p) {
  return p.limit.size() > 0 ? p.limit : Eigen::VectorXd::Constant(p.planes(), kInfinity);
}

}  // namespace

Eigen::VectorXcd CorrectionProblem::residual(const Eigen::VectorXcd& masses) const {
  return vibration + influence * masses;
}

void CorrectionProblem::check() const {
  if (rows() < 1 || planes() < 1) throw Error("balancing needs at least one reading and one plane");
  if (vibration.size() != rows())
    throw Error(
        fmt::format("balancing: {} vibration vectors for {} rows of influence coefficients", vibration.size(), rows()));
  if (weight.size() != 0 && weight.size() != rows())
    throw Error(fmt::format("balancing: {} weights for {} readings", weight.size(), rows()));
  if (limit.size() != 0 && limit.size() != planes())
    throw Error(fmt::format("balancing: {} mass limits for {} planes", limit.size(), planes()));
  if (!influence.allFinite()) throw Error("balancing: an influence coefficient is not finite");
  if (!vibration.allFinite()) throw Error("balancing: a vibration vector is not finite");
  for (Index m = 0; m < weight.size(); ++m) require_range(fmt::format("weight of row {}", m + 1), weight[m], 0, 1e12);
  if (weight.size() > 0 && weight.maxCoeff() <= 0) throw Error("balancing: every weight is zero");
  for (Index k = 0; k < limit.size(); ++k)
    if (!(limit[k] >= 0))
      throw Error::in_field(fmt::format("limit of plane {}", k + 1), fmt::format("{}", limit[k]), ">= 0");
}

double objective(const CorrectionProblem& p, Criterion criterion, const Eigen::VectorXcd& masses) {
  const Eigen::VectorXd r = p.residual(masses).cwiseAbs().cwiseProduct(weights(p));
  return criterion == Criterion::least_squares ? r.norm() : r.maxCoeff();
}

Correction solve_correction(const CorrectionProblem& p, Criterion criterion) {
  p.check();
  const Eigen::VectorXd s = weights(p), limit = limits(p);
  const Eigen::MatrixXcd a = s.asDiagonal() * p.influence;
  const Eigen::VectorXcd v = s.asDiagonal() * p.vibration;
  Correction c;
  c.masses = -a.completeOrthogonalDecomposition().solve(v);
  const bool inside = (c.masses.cwiseAbs().array() <= limit.array()).all();
  const bool exact = (v + a * c.masses).norm() <= 1e-12 * v.norm();
  if (inside && (criterion == Criterion::least_squares || exact)) {
    c.objective = objective(p, criterion, c.masses);
    c.bound = exact ? 0 : c.objective;
  } else {
    const BarrierResult solved = minimise_cones(a, v, limit, criterion == Criterion::min_max);
    c.masses = solved.masses;
    c.objective = objective(p, criterion, c.masses);
    c.bound = std::min(solved.bound, c.objective);
  }
  for (Index k = 0; k < p.planes(); ++k) c.limited = c.limited || std::abs(c.masses[k]) > limit[k] * (1 - 1e-4);
  c.residual = p.residual(c.masses);
  return c;
}

std::vector<int> PlaneIndependence::independent(double tolerance) const {
  std::vector<int> kept;
  for (std::size_t k = 0; k < significance.size(); ++k)
    if (significance[k] >= tolerance) kept.push_back(static_cast<int>(k));
  return kept;
}

PlaneIndependence plane_independence(const Eigen::MatrixXcd& influence) {
  const Index n = influence.cols();
  PlaneIndependence result;
  result.significance.assign(static_cast<std::size_t>(n), 0.0);
  result.twin.assign(static_cast<std::size_t>(n), -1);
  Eigen::MatrixXcd rest = influence;
  std::vector<bool> used(static_cast<std::size_t>(n), false);
  for (Index step = 0; step < n; ++step) {
    Index best = -1;
    for (Index k = 0; k < n; ++k)
      if (!used[static_cast<std::size_t>(k)] && (best < 0 || rest.col(k).norm() > rest.col(best).norm())) best = k;
    const auto b = static_cast<std::size_t>(best);
    used[b] = true;
    const double norm = influence.col(best).norm();
    result.significance[b] = norm > 0 ? rest.col(best).norm() / norm : 0;
    double alike = -1;
    for (const int earlier : result.order) {
      const double other = influence.col(earlier).norm();
      const double cosine =
          norm * other > 0 ? std::abs(influence.col(earlier).dot(influence.col(best))) / (norm * other) : 0;
      if (cosine > alike) {
        alike = cosine;
        result.twin[b] = earlier;
      }
    }
    result.order.push_back(static_cast<int>(best));
    // What is left of rounding is no direction of its own.
    if (rest.col(best).norm() <= 1e-13 * norm) continue;
    const Eigen::VectorXcd q = rest.col(best).normalized();
    for (Index k = 0; k < n; ++k)
      if (!used[static_cast<std::size_t>(k)]) rest.col(k) -= q * q.dot(rest.col(k));
  }
  return result;
}

}  // namespace whirl::diagnosis
