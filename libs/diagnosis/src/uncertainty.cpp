#include <cmath>
#include <numbers>
#include <random>

#include "influence_fit.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

double t_quantile(double freedom) {
  if (std::isnan(freedom) || !(freedom > 0)) return std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(freedom) || freedom > 1e6) return 1.959964;
  return students_t_quantile(freedom, 0.975);
}

/// (baseline, [drift], influence) -> what multiplies it in baseline + influence w at the reference time.
Eigen::VectorXcd at_masses(const InfluenceFit& fit, const Eigen::VectorXcd& masses) {
  const Index first = fit.with_drift ? 2 : 1;
  Eigen::VectorXcd c = Eigen::VectorXcd::Zero(first + masses.size());
  c[0] = 1;
  c.tail(masses.size()) = masses;
  return c;
}

}  // namespace

double circle_radius(double freedom) {
  if (std::isnan(freedom) || !(freedom > 0)) return std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(freedom)) return 2.447747;
  return std::sqrt(2 * fisher_f_quantile(2, freedom, 0.95));
}

CorrectionUncertainty correction_uncertainty(const InfluenceFit& fit, const CorrectionProblem& problem,
                                             const Eigen::VectorXcd& masses) {
  const Index planes = problem.planes();
  const Eigen::VectorXd s = problem.weight.size() > 0 ? problem.weight : Eigen::VectorXd::Ones(problem.rows());
  const Eigen::MatrixXcd a = problem.influence;
  const Eigen::MatrixXcd normal = a.adjoint() * s.cwiseAbs2().asDiagonal() * a;
  const Eigen::MatrixXcd inverse = normal.completeOrthogonalDecomposition().pseudoInverse();
  const Eigen::VectorXcd r = problem.residual(masses), c = at_masses(fit, masses);
  // dw = sum over runs of left e + right conj(e), e the errors of one run's readings, circular with covariance scatter.
  std::vector<Eigen::MatrixXcd> by_baseline, by_influence;
  for (Index m = 0; m < problem.rows(); ++m) {
    by_baseline.emplace_back(-s[m] * s[m] * inverse * a.row(m).adjoint() * c.transpose());
    by_influence.emplace_back(Eigen::MatrixXcd::Zero(planes, c.size()));
    by_influence.back().rightCols(planes) = -s[m] * s[m] * r[m] * inverse;
  }
  Eigen::MatrixXcd proper = Eigen::MatrixXcd::Zero(planes, planes), improper = proper;
  CorrectionUncertainty u;
  u.spread.resize(static_cast<std::size_t>(planes));
  const Index first = fit.with_drift ? 2 : 1;
  for (Index run = 0; run < fit.gain.front().cols(); ++run) {
    Eigen::MatrixXcd left(planes, problem.rows()), right(planes, problem.rows());
    for (Index m = 0; m < problem.rows(); ++m) {
      const auto i = static_cast<std::size_t>(m);
      left.col(m) = by_baseline[i] * fit.gain[i].col(run);
      right.col(m) = by_influence[i] * fit.gain[i].col(run).conjugate();
    }
    proper += left * fit.scatter * left.adjoint() + right * fit.scatter.conjugate() * right.adjoint();
    improper += left * fit.scatter * right.transpose() + right * fit.scatter.conjugate() * left.transpose();
    for (Index p = 0; p < planes; ++p) {
      // More mass on plane p: its influence weighs more.
      Eigen::RowVectorXcd more(problem.rows());
      for (Index m = 0; m < problem.rows(); ++m)
        more[m] = -s[m] * s[m] * (inverse.row(p) * a.row(m).adjoint())(0) *
                  fit.gain[static_cast<std::size_t>(m)](first + p, run);
      CorrectionUncertainty::Spread& spread = u.spread[static_cast<std::size_t>(p)];
      const Eigen::RowVectorXcd scattered = more * fit.scatter;
      spread.grown += (scattered * more.adjoint())(0).real();
      spread.mixed += (scattered * left.row(p).adjoint())(0);
      spread.improper_grown += 2.0 * (scattered * right.row(p).transpose())(0);
    }
  }
  u.covariance.resize(2 * planes, 2 * planes);
  u.covariance.topLeftCorner(planes, planes) = 0.5 * (proper + improper).real();
  u.covariance.bottomRightCorner(planes, planes) = 0.5 * (proper - improper).real();
  u.covariance.topRightCorner(planes, planes) = 0.5 * (improper - proper).imag();
  u.covariance.bottomLeftCorner(planes, planes) = 0.5 * (improper + proper).imag();
  for (Index p = 0; p < planes; ++p) {
    u.spread[static_cast<std::size_t>(p)].own = proper(p, p).real();
    u.spread[static_cast<std::size_t>(p)].improper = improper(p, p);
  }
  u.freedom = fit.noise.allFinite() ? 2 * fit.spare : std::numeric_limits<double>::quiet_NaN();
  u.quantile = t_quantile(u.freedom);
  return u;
}

CorrectionUncertainty redrawn_uncertainty(const InfluenceFit& fit, const CorrectionProblem& problem,
                                          Criterion criterion, int draws, unsigned seed) {
  require_range("draws", draws, 10, 1e6);
  const Index planes = problem.planes(), first = fit.with_drift ? 2 : 1;
  CorrectionUncertainty u;
  u.covariance = Eigen::MatrixXd::Constant(2 * planes, 2 * planes, std::numeric_limits<double>::quiet_NaN());
  u.freedom = 2 * fit.spare;
  u.quantile = t_quantile(u.freedom);
  if (!fit.noise.allFinite()) return u;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  // Errors of one run's readings come together: columns of root times white noise.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd> axes(fit.scatter);
  const Eigen::MatrixXcd root = axes.eigenvectors() * (0.5 * axes.eigenvalues()).cwiseMax(0).cwiseSqrt().asDiagonal();
  Eigen::MatrixXd samples(draws, 2 * planes);
  for (int d = 0; d < draws; ++d) {
    CorrectionProblem drawn = problem;
    Eigen::MatrixXcd white(problem.rows(), fit.gain.front().cols());
    for (std::complex<double>& z : white.reshaped()) z = {normal(random), normal(random)};
    const Eigen::MatrixXcd error = root * white;
    for (Index m = 0; m < problem.rows(); ++m) {
      const Eigen::VectorXcd moved = fit.gain[static_cast<std::size_t>(m)] * error.row(m).transpose();
      drawn.vibration[m] += moved[0];
      drawn.influence.row(m) += moved.segment(first, planes).transpose();
    }
    const Eigen::VectorXcd w = solve_correction(drawn, criterion).masses;
    samples.row(d) << w.real().transpose(), w.imag().transpose();
  }
  const Eigen::RowVectorXd mean = samples.colwise().mean();
  samples.rowwise() -= mean;
  u.covariance = samples.transpose() * samples / (draws - 1);
  return u;
}

namespace {

/// Square of the distance from the computed mass, in its error were the true one d off.
double off_square(const CorrectionUncertainty::Spread& s, std::complex<double> d) {
  const double proper = s.own + 2 * (std::conj(d) * s.mixed).real() + std::norm(d) * s.grown;
  const std::complex<double> improper = s.improper + d * s.improper_grown;
  const double re = 0.5 * (proper + improper.real()), im = 0.5 * (proper - improper.real()),
               cross = 0.5 * improper.imag(), determinant = re * im - cross * cross;
  if (!(determinant > 0)) return std::numeric_limits<double>::infinity();
  return (im * d.real() * d.real() - 2 * cross * d.real() * d.imag() + re * d.imag() * d.imag()) / determinant;
}

/// What all masses within the quantile span, seen from the computed one.
struct Span {
  double low_re = 0, high_re = 0, low_im = 0, high_im = 0;
  double smallest = 0, largest = 0, low_turn = 0, high_turn = 0;
};

Span span_of(const CorrectionUncertainty::Spread& s, double quantile, std::complex<double> w) {
  constexpr int kDirections = 180;
  constexpr double kFar = 1e4;  // sd: no bound
  const double square = quantile * quantile, sd = std::sqrt(std::max(s.own, 0.0));
  Span span;
  span.smallest = span.largest = std::abs(w);
  for (int k = 0; k < kDirections; ++k) {
    const std::complex<double> along = std::polar(1.0, 2 * std::numbers::pi * k / kDirections);
    double inside = 0, outside = 0.5 * sd;
    while (outside < kFar * sd && off_square(s, outside * along) <= square) inside = outside, outside *= 1.3;
    if (outside >= kFar * sd) inside = outside = std::numeric_limits<double>::infinity();
    for (int step = 0; step < 30 && std::isfinite(outside); ++step) {
      const double middle = 0.5 * (inside + outside);
      (off_square(s, middle * along) <= square ? inside : outside) = middle;
    }
    if (std::isinf(inside)) {
      span.largest = inside;
      (along.real() > 0 ? span.high_re : span.low_re) = std::copysign(inside, along.real());
      (along.imag() > 0 ? span.high_im : span.low_im) = std::copysign(inside, along.imag());
      const double turn = std::arg(along / w);
      span.low_turn = std::min(span.low_turn, turn);
      span.high_turn = std::max(span.high_turn, turn);
      continue;
    }
    const std::complex<double> d = inside * along;
    span.low_re = std::min(span.low_re, d.real());
    span.high_re = std::max(span.high_re, d.real());
    span.low_im = std::min(span.low_im, d.imag());
    span.high_im = std::max(span.high_im, d.imag());
    span.smallest = std::min(span.smallest, std::abs(w + d));
    span.largest = std::max(span.largest, std::abs(w + d));
    const double turn = std::arg((w + d) / w);
    span.low_turn = std::min(span.low_turn, turn);
    span.high_turn = std::max(span.high_turn, turn);
  }
  if (off_square(s, -w) <= square) {
    span.smallest = 0;
    span.low_turn = -std::numbers::pi;
    span.high_turn = std::numbers::pi;
  }
  return span;
}

/// The spread of a plane: as computed, or that of the covariance alone.
CorrectionUncertainty::Spread spread_of(const CorrectionUncertainty& u, Index p) {
  if (!u.spread.empty()) return u.spread[static_cast<std::size_t>(p)];
  const Index q = u.covariance.rows() / 2 + p;
  CorrectionUncertainty::Spread s;
  s.own = u.covariance(p, p) + u.covariance(q, q);
  s.improper = {u.covariance(p, p) - u.covariance(q, q), 2 * u.covariance(p, q)};
  return s;
}

bool is_known(const CorrectionUncertainty& u, Index p) {
  return std::isfinite(u.quantile) && std::isfinite(u.covariance(p, p));
}

Estimate unknown_estimate(double value) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  return {value, kUnknown, kUnknown, kUnknown};
}

}  // namespace

Estimate CorrectionUncertainty::real(Index p, const Eigen::VectorXcd& w) const {
  if (!is_known(*this, p)) return unknown_estimate(w[p].real());
  const Span span = span_of(spread_of(*this, p), quantile, w[p]);
  return {w[p].real(), std::sqrt(covariance(p, p)), w[p].real() + span.low_re, w[p].real() + span.high_re};
}
Estimate CorrectionUncertainty::imag(Index p, const Eigen::VectorXcd& w) const {
  if (!is_known(*this, p)) return unknown_estimate(w[p].imag());
  const Span span = span_of(spread_of(*this, p), quantile, w[p]);
  const Index q = w.size() + p;
  return {w[p].imag(), std::sqrt(covariance(q, q)), w[p].imag() + span.low_im, w[p].imag() + span.high_im};
}
Estimate CorrectionUncertainty::magnitude(Index p, const Eigen::VectorXcd& w) const {
  if (!is_known(*this, p)) return unknown_estimate(std::abs(w[p]));
  const Index q = w.size() + p;
  const double a = std::abs(w[p]), c = a > 0 ? w[p].real() / a : 1, s = a > 0 ? w[p].imag() / a : 0;
  const double variance = c * c * covariance(p, p) + 2 * c * s * covariance(p, q) + s * s * covariance(q, q);
  const Span span = span_of(spread_of(*this, p), quantile, w[p]);
  return {a, std::sqrt(std::max(variance, 0.0)), span.smallest, span.largest};
}
Estimate CorrectionUncertainty::angle(Index p, const Eigen::VectorXcd& w) const {
  const double value = std::arg(w[p]), a = std::abs(w[p]);
  if (!is_known(*this, p)) return unknown_estimate(value);
  if (!(a > 0)) return {value, std::numbers::pi, value - std::numbers::pi, value + std::numbers::pi};
  const Index q = w.size() + p;
  const double c = w[p].real() / a, s = w[p].imag() / a;
  const double variance = s * s * covariance(p, p) - 2 * c * s * covariance(p, q) + c * c * covariance(q, q);
  const Span span = span_of(spread_of(*this, p), quantile, w[p]);
  return {value, std::sqrt(std::max(variance, 0.0)) / a, value + span.low_turn, value + span.high_turn};
}

std::vector<Estimate> predicted_residual(const InfluenceFit& fit, const Eigen::VectorXcd& masses) {
  const Eigen::VectorXcd c = at_masses(fit, masses);
  std::vector<Estimate> result;
  for (Index m = 0; m < fit.baseline.size(); ++m) {
    const std::complex<double> r = fit.baseline[m] + (fit.influence.row(m) * masses)(0);
    const Eigen::MatrixXcd& g = fit.cofactor[static_cast<std::size_t>(m)];
    const double sd =
        std::sqrt(0.5 * fit.scatter(m, m).real() * std::max(0.0, (c.transpose() * g * c.conjugate())(0, 0).real()));
    // The 95 % circle about the vector (Hotelling, two dimensions): its nearest and farthest point from zero.
    const double radius = sd * circle_radius(2 * fit.spare);
    result.push_back({std::abs(r), sd, std::max(std::abs(r) - radius, 0.0), std::abs(r) + radius});
  }
  return result;
}

}  // namespace whirl::diagnosis
