#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

double t_quantile(double freedom) {
  if (std::isnan(freedom) || !(freedom > 0)) return std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(freedom) || freedom > 1e6) return 1.959964;
  return boost::math::quantile(boost::math::students_t(freedom), 0.975);
}

/// (baseline, [drift], influence) -> what multiplies it in baseline + influence w at the reference time.
Eigen::VectorXcd at_masses(const InfluenceFit& fit, const Eigen::VectorXcd& masses) {
  const Index first = fit.with_drift ? 2 : 1;
  Eigen::VectorXcd c = Eigen::VectorXcd::Zero(first + masses.size());
  c[0] = 1;
  c.tail(masses.size()) = masses;
  return c;
}

Estimate symmetric(double value, double sd, double quantile) {
  return {value, sd, value - quantile * sd, value + quantile * sd};
}

}  // namespace

CorrectionUncertainty correction_uncertainty(const InfluenceFit& fit, const CorrectionProblem& problem,
                                             const Eigen::VectorXcd& masses) {
  const Index planes = problem.planes();
  const Eigen::VectorXd s = problem.weight.size() > 0 ? problem.weight : Eigen::VectorXd::Ones(problem.rows());
  const Eigen::MatrixXcd a = problem.influence;
  const Eigen::MatrixXcd normal = a.adjoint() * s.cwiseAbs2().asDiagonal() * a;
  const Eigen::MatrixXcd inverse = normal.completeOrthogonalDecomposition().pseudoInverse();
  const Eigen::VectorXcd r = problem.residual(masses), c = at_masses(fit, masses);
  Eigen::MatrixXcd proper = Eigen::MatrixXcd::Zero(planes, planes), improper = proper;
  std::map<int, Eigen::VectorXd> by_speed;  // variance of each plane that one speed's noise brings
  for (Index m = 0; m < problem.rows(); ++m) {
    const double s2 = s[m] * s[m], scale = 2 * fit.noise[m] * fit.noise[m];
    const Eigen::MatrixXcd& g = fit.cofactor[static_cast<std::size_t>(m)];
    // dw = left dbeta + right conj(dbeta), dbeta circular with covariance scale * g.
    const Eigen::MatrixXcd left = -s2 * inverse * a.row(m).adjoint() * c.transpose();
    Eigen::MatrixXcd right = Eigen::MatrixXcd::Zero(planes, c.size());
    right.rightCols(planes) = -s2 * r[m] * inverse;
    const Eigen::MatrixXcd own = scale * (left * g * left.adjoint() + right * g.conjugate() * right.adjoint());
    proper += own;
    improper += scale * (left * g * right.transpose() + right * g.conjugate() * left.transpose());
    Eigen::VectorXd& share = by_speed[fit.speed[static_cast<std::size_t>(m)]];
    if (share.size() == 0) share = Eigen::VectorXd::Zero(planes);
    share += own.diagonal().real();
  }
  CorrectionUncertainty u;
  u.covariance.resize(2 * planes, 2 * planes);
  u.covariance.topLeftCorner(planes, planes) = 0.5 * (proper + improper).real();
  u.covariance.bottomRightCorner(planes, planes) = 0.5 * (proper - improper).real();
  u.covariance.topRightCorner(planes, planes) = 0.5 * (improper - proper).imag();
  u.covariance.bottomLeftCorner(planes, planes) = 0.5 * (improper + proper).imag();
  u.freedom = std::numeric_limits<double>::infinity();
  for (Index p = 0; p < planes; ++p) {
    double sum = 0, weighted = 0;
    for (const auto& [speed, share] : by_speed) {
      double freedom = 0;
      for (Index m = 0; m < problem.rows(); ++m)
        if (fit.speed[static_cast<std::size_t>(m)] == speed) freedom = fit.freedom[m];
      sum += share[p];
      weighted += share[p] * share[p] / freedom;
    }
    if (weighted > 0) u.freedom = std::min(u.freedom, sum * sum / weighted);
  }
  if (!fit.noise.allFinite()) u.freedom = std::numeric_limits<double>::quiet_NaN();
  u.quantile = t_quantile(u.freedom);
  return u;
}

CorrectionUncertainty redrawn_uncertainty(const InfluenceFit& fit, const CorrectionProblem& problem,
                                          Criterion criterion, int draws, unsigned seed) {
  require_range("draws", draws, 10, 1e6);
  const Index planes = problem.planes(), first = fit.with_drift ? 2 : 1;
  CorrectionUncertainty u;
  u.covariance = Eigen::MatrixXd::Constant(2 * planes, 2 * planes, std::numeric_limits<double>::quiet_NaN());
  u.freedom = fit.freedom.minCoeff();
  u.quantile = t_quantile(u.freedom);
  if (!fit.noise.allFinite()) return u;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Eigen::MatrixXcd> roots;
  for (const Eigen::MatrixXcd& g : fit.cofactor) roots.emplace_back(g.llt().matrixL());
  Eigen::MatrixXd samples(draws, 2 * planes);
  for (int d = 0; d < draws; ++d) {
    CorrectionProblem drawn = problem;
    for (Index m = 0; m < problem.rows(); ++m) {
      Eigen::VectorXcd white(roots[static_cast<std::size_t>(m)].rows());
      for (Index k = 0; k < white.size(); ++k) white[k] = {normal(random), normal(random)};
      const Eigen::VectorXcd error = fit.noise[m] * (roots[static_cast<std::size_t>(m)] * white);
      drawn.vibration[m] += error[0];
      drawn.influence.row(m) += error.segment(first, planes).transpose();
    }
    const Eigen::VectorXcd w = solve_correction(drawn, criterion).masses;
    samples.row(d) << w.real().transpose(), w.imag().transpose();
  }
  const Eigen::RowVectorXd mean = samples.colwise().mean();
  samples.rowwise() -= mean;
  u.covariance = samples.transpose() * samples / (draws - 1);
  return u;
}

Estimate CorrectionUncertainty::real(Index p, const Eigen::VectorXcd& w) const {
  return symmetric(w[p].real(), std::sqrt(covariance(p, p)), quantile);
}
Estimate CorrectionUncertainty::imag(Index p, const Eigen::VectorXcd& w) const {
  const Index q = w.size() + p;
  return symmetric(w[p].imag(), std::sqrt(covariance(q, q)), quantile);
}
Estimate CorrectionUncertainty::magnitude(Index p, const Eigen::VectorXcd& w) const {
  const Index q = w.size() + p;
  const double a = std::abs(w[p]), c = a > 0 ? w[p].real() / a : 1, s = a > 0 ? w[p].imag() / a : 0;
  const double variance = c * c * covariance(p, p) + 2 * c * s * covariance(p, q) + s * s * covariance(q, q);
  Estimate e = symmetric(a, std::sqrt(std::max(variance, 0.0)), quantile);
  e.low = std::max(e.low, 0.0);
  return e;
}
Estimate CorrectionUncertainty::angle(Index p, const Eigen::VectorXcd& w) const {
  const Index q = w.size() + p;
  const double a = std::abs(w[p]), c = a > 0 ? w[p].real() / a : 1, s = a > 0 ? w[p].imag() / a : 0;
  const double variance = s * s * covariance(p, p) - 2 * c * s * covariance(p, q) + c * c * covariance(q, q);
  const double across = std::sqrt(std::max(variance, 0.0)), value = std::arg(w[p]);
  if (std::isnan(across)) return {value, across, across, across};
  if (quantile * across >= a)
    return {value, a > 0 ? across / a : std::numbers::pi, value - std::numbers::pi, value + std::numbers::pi};
  const double half = std::asin(quantile * across / a);
  return {value, across / a, value - half, value + half};
}

std::vector<Estimate> predicted_residual(const InfluenceFit& fit, const Eigen::VectorXcd& masses) {
  const Eigen::VectorXcd c = at_masses(fit, masses);
  std::vector<Estimate> result;
  for (Index m = 0; m < fit.baseline.size(); ++m) {
    const std::complex<double> r = fit.baseline[m] + (fit.influence.row(m) * masses)(0);
    const Eigen::MatrixXcd& g = fit.cofactor[static_cast<std::size_t>(m)];
    const double sd = fit.noise[m] * std::sqrt(std::max(0.0, (c.transpose() * g * c.conjugate())(0, 0).real()));
    // The 95 % circle about the vector (Hotelling, two dimensions): its nearest and farthest point from zero.
    double radius = 2.447747 * sd;
    if (std::isfinite(fit.freedom[m]) && fit.freedom[m] > 0)
      radius = sd * std::sqrt(2 * boost::math::quantile(boost::math::fisher_f(2, fit.freedom[m]), 0.95));
    result.push_back({std::abs(r), sd, std::max(std::abs(r) - radius, 0.0), std::abs(r) + radius});
  }
  return result;
}

}  // namespace whirl::diagnosis
