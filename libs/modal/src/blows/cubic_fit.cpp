#include "blows/cubic_fit.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

double law(const Eigen::Vector3d& p, double x) {
  const double u = x - p[2];
  return p[0] * u + p[1] * u * u * u;
}
double slope(const Eigen::Vector3d& p, double x) { return p[0] + 3 * p[1] * (x - p[2]) * (x - p[2]); }

// The most likely true x of a point: the foot of its perpendicular, in units of the noise.
double foot(const Eigen::Vector3d& p, double x, double f, double ratio) {
  double at = x;
  for (int i = 0; i < 20; ++i) {
    const double g = slope(p, at), r2 = ratio * ratio;
    const double step = ((f - law(p, at)) * g * r2 + x - at) / (1 + r2 * g * g);
    at += step;
    if (std::abs(step) < 1e-14 * (1 + std::abs(x))) break;
  }
  return at;
}

// Residuals, weights and weighted Jacobian at p; `extra` multiplies the weights.
void evaluate(const VectorXd& x, const VectorXd& f, double ratio, const VectorXd& extra, CubicFit& fit) {
  fit.likelihood = 0;
  for (Index i = 0; i < x.size(); ++i) {
    const double at = ratio > 0 ? foot(fit.p, x[i], f[i], ratio) : x[i];
    const double g = slope(fit.p, at), u = at - fit.p[2];
    const double variance = 1 + ratio * ratio * g * g;
    fit.residual[i] = f[i] - law(fit.p, at) - g * (x[i] - at);
    fit.weight[i] = extra[i] / std::sqrt(variance);
    fit.jacobian(i, 0) = fit.weight[i] * u;
    fit.jacobian(i, 1) = fit.weight[i] * u * u * u;
    if (fit.jacobian.cols() == 3) fit.jacobian(i, 2) = -fit.weight[i] * g;
    fit.likelihood += std::log(variance);
  }
  fit.cost = fit.weight.cwiseProduct(fit.residual).squaredNorm();
  const auto n = static_cast<double>(x.size());
  fit.likelihood += n * std::log(std::max(fit.cost / n, 1e-300));
}

// Gauss-Newton with halved steps.
void halve_down(const VectorXd& x, const VectorXd& f, double ratio, const VectorXd& extra, CubicFit& fit) {
  evaluate(x, f, ratio, extra, fit);
  fit.converged = false;
  for (int iteration = 0; iteration < 100 && !fit.converged; ++iteration) {
    const VectorXd step = Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(fit.jacobian)
                              .solve(VectorXd(fit.weight.cwiseProduct(fit.residual)));
    const CubicFit before = fit;
    double scale = 1;
    for (int halving = 0; halving < 30; ++halving, scale /= 2) {
      fit.p = before.p;
      fit.p.head(fit.jacobian.cols()) += scale * step;
      evaluate(x, f, ratio, extra, fit);
      if (fit.cost <= before.cost) break;
    }
    const bool better = fit.cost <= before.cost;
    const bool done = step.norm() * scale < 1e-12 * (1 + before.p.norm()) || fit.cost > before.cost * (1 - 1e-14);
    if (!better) fit = before;
    fit.converged = done;
  }
}

CubicFit start(const VectorXd& x, const VectorXd& f, Index parameters) {
  CubicFit fit;
  fit.jacobian.resize(x.size(), parameters);
  fit.residual = fit.weight = VectorXd::Zero(x.size());
  const double line = ((x.array() - x.mean()) * (f.array() - f.mean())).sum() / (x.array() - x.mean()).square().sum();
  fit.p = {line, 0, parameters == 3 && line != 0 ? x.mean() - f.mean() / line : 0};
  return fit;
}

double median_size(VectorXd v) {
  v = v.cwiseAbs().eval();
  std::nth_element(v.data(), v.data() + v.size() / 2, v.data() + v.size());
  return v[v.size() / 2];
}

// t value of a point against a fit on the chosen others.
double surprise(const VectorXd& x, const VectorXd& f, Index parameters, const std::vector<bool>& chosen, Index point,
                double& freedom) {
  VectorXd extra(x.size());
  for (Index i = 0; i < x.size(); ++i) extra[i] = chosen[static_cast<std::size_t>(i)] && i != point ? 1 : 0;
  CubicFit fit = start(x, f, parameters);
  halve_down(x, f, 0, extra, fit);
  freedom = extra.sum() - static_cast<double>(parameters);
  const double u = x[point] - fit.p[2];
  VectorXd row(parameters);
  row[0] = u;
  row[1] = u * u * u;
  if (parameters == 3) row[2] = -slope(fit.p, x[point]);
  const double s2 = fit.cost / freedom;
  const double variance = s2 * (1 + row.dot(inverse(fit.jacobian.transpose() * fit.jacobian) * row));
  const double noise = 1e-12 * f.cwiseAbs().maxCoeff();
  return std::abs(fit.residual[point]) / std::sqrt(variance + noise * noise);
}

}  // namespace

CubicFit fit_cubic(const VectorXd& x, const VectorXd& f, Index parameters, double ratio) {
  CubicFit fit = start(x, f, parameters);
  const VectorXd ones = VectorXd::Ones(x.size());
  halve_down(x, f, 0, ones, fit);
  if (ratio > 0) halve_down(x, f, ratio, ones, fit);
  return fit;
}

std::vector<Index> outliers_of(const VectorXd& x, const VectorXd& f, Index parameters, double chance) {
  const Index n = x.size(), spare = n - parameters;
  if (spare < 4) return {};
  // Least absolute residuals, by reweighting.
  CubicFit fit = start(x, f, parameters);
  VectorXd extra = VectorXd::Ones(n);
  for (int i = 0; i < 30; ++i) {
    halve_down(x, f, 0, extra, fit);
    const double floor = std::max(1e-3 * median_size(fit.residual), 1e-13 * f.cwiseAbs().maxCoeff());
    extra = fit.residual.cwiseAbs().cwiseMax(floor).cwiseInverse().cwiseSqrt();
    extra /= extra.maxCoeff();
  }
  std::vector<Index> order(static_cast<std::size_t>(n));
  for (Index i = 0; i < n; ++i) order[static_cast<std::size_t>(i)] = i;
  std::sort(order.begin(), order.end(),
            [&](Index a, Index b) { return std::abs(fit.residual[a]) > std::abs(fit.residual[b]); });
  // The largest few are suspects; each must be told from a fit on all that are none.
  const auto most = static_cast<std::size_t>(std::min<Index>(n / 5, spare - 3));
  order.resize(most);
  std::vector<bool> chosen(static_cast<std::size_t>(n), true);
  for (const Index i : order) chosen[static_cast<std::size_t>(i)] = false;
  std::vector<Index> found;
  for (bool changed = true; changed;) {  // the mildest suspects join again, the others are judged with them
    changed = false;
    double least = INFINITY, freedom = 0;
    std::size_t mildest = 0;
    for (std::size_t k = 0; k < order.size(); ++k) {
      const double t = surprise(x, f, parameters, chosen, order[k], freedom);
      if (t < least) least = t, mildest = k;
    }
    if (order.empty()) break;
    const double p = 2 * students_t_tail(std::max(1.0, freedom), std::min(least, 1e6));
    if (p * static_cast<double>(n) > chance) {
      chosen[static_cast<std::size_t>(order[mildest])] = true;
      order.erase(order.begin() + static_cast<std::ptrdiff_t>(mildest));
      changed = true;
    }
  }
  found = order;
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace whirl::modal
