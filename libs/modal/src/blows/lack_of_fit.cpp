#include "blows/lack_of_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kChance = 1e-3;

/// Correlation of the residuals from one deflection to the next, and how many deflections there are; readings at one
/// deflection (loading and unloading, repeats) are averaged.
std::pair<double, Index> correlation_along(const VectorXd& x, const VectorXd& residual) {
  std::vector<Index> order(static_cast<std::size_t>(x.size()));
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return x[a] < x[b]; });
  const double same = 1e-3 * (x.maxCoeff() - x.minCoeff());
  std::vector<double> mean;
  for (std::size_t i = 0; i < order.size();) {
    double sum = 0, n = 0;
    const double at = x[order[i]];
    for (; i < order.size() && x[order[i]] - at <= same; ++i) sum += residual[order[i]], n += 1;
    mean.push_back(sum / n);
  }
  double squares = 0, products = 0;
  for (std::size_t i = 0; i < mean.size(); ++i) {
    squares += mean[i] * mean[i];
    if (i > 0) products += mean[i] * mean[i - 1];
  }
  return {squares > 0 ? products / squares : 0, static_cast<Index>(mean.size())};
}

}  // namespace

LackOfFit lack_of_fit(const VectorXd& x, const VectorXd& plain, const VectorXd& weight, const Eigen::MatrixXd& jacobian,
                      double offset) {
  const VectorXd residual = plain.cwiseProduct(weight);
  LackOfFit found;
  found.shift = VectorXd::Zero(jacobian.cols());
  const double freedom = static_cast<double>(x.size() - jacobian.cols()) - 1;
  if (freedom < 4 || residual.norm() < 1e-9 * std::sqrt(static_cast<double>(x.size()))) return found;
  const VectorXd d = x.array() - offset;
  const std::pair<VectorXd, const char*> terms[] = {
      {d.array().square(), "a term in d^2 fits better (not the same spring on both sides)"},
      {d.array().pow(5), "a term in d^5 fits better (stiffer at large deflections than d^3, or clearance)"},
      {d.array().sign(), "a step where the deflection changes sign fits better (friction or clearance)"}};
  const Eigen::MatrixXd inverse_information = inverse(Eigen::MatrixXd(jacobian.transpose() * jacobian));
  double least = kChance / static_cast<double>(std::size(terms));
  for (const auto& [term, name] : terms) {
    const VectorXd g = term.cwiseProduct(weight);
    const VectorXd onto = inverse_information * (jacobian.transpose() * g);
    const VectorXd own = g - jacobian * onto;
    const double size = own.squaredNorm();
    if (size < 1e-8 * g.squaredNorm()) continue;
    const double coefficient = own.dot(residual) / size;
    const double left = std::max(residual.squaredNorm() - coefficient * coefficient * size, 1e-300);
    const double t = std::abs(coefficient) * std::sqrt(size) / std::sqrt(left / freedom);
    const double chance = 2 * students_t_tail(freedom, t);
    if (chance >= least) continue;
    least = chance;
    found.law = name;
    found.shift = onto * coefficient;
  }
  const auto [correlation, places] = correlation_along(x, residual);
  constexpr double kSeen = 3.1;  // sd of the correlation of white residuals is 1 / sqrt(places)
  if (places >= 8 && correlation * std::sqrt(static_cast<double>(places)) > kSeen) {
    if (found.law.empty()) found.law = "the residuals hang together along the deflection (clearance, a stop, a slip)";
    found.widening = std::sqrt((1 + correlation) / (1 - std::min(correlation, 0.95)));
  }
  return found;
}

std::vector<Index> at_limit(const VectorXd& x, const VectorXd& force, int sign) {
  const double limit = sign > 0 ? force.maxCoeff() : force.minCoeff();
  std::vector<Index> points;
  double low = INFINITY, high = -INFINITY;
  for (Index i = 0; i < force.size(); ++i) {
    if (force[i] != limit) continue;
    points.push_back(i);
    low = std::min(low, x[i]);
    high = std::max(high, x[i]);
  }
  const bool stretch = points.size() >= 3 && high - low > 0.05 * (x.maxCoeff() - x.minCoeff());
  return stretch ? points : std::vector<Index>{};
}

}  // namespace whirl::modal
