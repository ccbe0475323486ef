// One row at a time, from many starts: lengths alone leave several minima (two circles cut twice). Every row's minima
// that the readings allow are kept, then combined over the rows.
#include "whirl/diagnosis/amplitudes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/least_squares.hpp"
#include "whirl/core/nan.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

constexpr int kStartsOfPlane = 40;        // random starts a plane and row
constexpr std::size_t kMostAnswers = 64;  // combinations of the minima of the rows
constexpr double kSameAnswer = 0.05;      // masses that differ by less, of the larger, are one answer

/// |baseline + influence masses| of one row against its readings; all of size 1.
struct LengthProblem {
  Eigen::MatrixXcd masses;  ///< runs x planes
  Eigen::VectorXd read;

  Eigen::VectorXcd vectors(const Eigen::VectorXd& at) const {
    Eigen::VectorXcd influence(masses.cols());
    for (Index p = 0; p < influence.size(); ++p) influence[p] = {at[1 + 2 * p], at[2 + 2 * p]};
    return (masses * influence).array() + at[0];
  }
  Eigen::MatrixXd slope(const Eigen::VectorXd& at) const {
    const Eigen::VectorXcd v = vectors(at);
    Eigen::MatrixXd j(read.size(), at.size());
    for (Index r = 0; r < read.size(); ++r) {
      const std::complex<double> along = std::conj(v[r]) / std::max(std::abs(v[r]), 1e-12);
      j(r, 0) = along.real();
      for (Index p = 0; p < masses.cols(); ++p) {
        j(r, 1 + 2 * p) = (along * masses(r, p)).real();
        j(r, 2 + 2 * p) = -(along * masses(r, p)).imag();
      }
    }
    return j;
  }
  void linearise(const Eigen::VectorXd& at, SquareSum& sum) const {
    const Eigen::VectorXd residual = read - vectors(at).cwiseAbs();
    const Eigen::MatrixXd j = slope(at);
    sum.cost = residual.squaredNorm();
    sum.normal = j.transpose() * j;
    sum.gradient = j.transpose() * residual;
  }
  void last(const Eigen::VectorXd& at, SquareSum& sum) const { linearise(at, sum); }
  Eigen::VectorXd moved(const Eigen::VectorXd& at, const Eigen::VectorXd& step) const { return at + step; }
  bool small(const SquareSum& sum, const Eigen::VectorXd& step, double decrease) const {
    return decrease <= 1e-14 * (sum.cost + 1e-14) || step.norm() < 1e-12;
  }
};

/// Rows of one job in their units.
struct Scales {
  double reading = 1, mass = 1;
};

Scales scales_of(const BalancingJob& job) {
  double reading = 0, mass = 0, n = 0, k = 0;
  for (const BalancingRun& run : job.runs) {
    for (const std::complex<double>& v : run.vibration)
      if (!std::isnan(v.real())) reading += std::norm(v), n += 1;
    for (const std::complex<double>& w : run.masses)
      if (w != 0.0) mass += std::norm(w), k += 1;
  }
  return {reading > 0 ? std::sqrt(reading / n) : 1, mass > 0 ? std::sqrt(mass / k) : 1};
}

/// Minima of one row, the best first. Baselines are made >= 0.
std::vector<AmplitudeRow> minima_of(const BalancingJob& job, Index row, const Scales& scale) {
  const auto planes = static_cast<Index>(job.planes.size()), runs = static_cast<Index>(job.runs.size());
  LengthProblem problem;
  std::vector<Index> read;
  for (Index r = 0; r < runs; ++r)
    if (!std::isnan(job.runs[static_cast<std::size_t>(r)].vibration[row].real())) read.push_back(r);
  problem.masses.resize(static_cast<Index>(read.size()), planes);
  problem.read.resize(static_cast<Index>(read.size()));
  for (std::size_t k = 0; k < read.size(); ++k) {
    const BalancingRun& run = job.runs[static_cast<std::size_t>(read[k])];
    problem.masses.row(static_cast<Index>(k)) = run.masses.transpose() / scale.mass;
    problem.read[static_cast<Index>(k)] = std::abs(run.vibration[row]) / scale.reading;
  }
  const std::string& name = job.rows[static_cast<std::size_t>(row)];
  const Index unknowns = 1 + 2 * planes;
  if (problem.read.size() < unknowns)
    throw Error(fmt::format(
        "{}: {} runs read it; amplitudes alone need {} at least and {} to be sure (as found, and {} trial masses at "
        "three angles): make more runs, or read the phase",
        name, read.size(), unknowns, unknowns + 1, planes == 1 ? "a plane's" : "each plane's"));
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> turn(0, 2 * std::numbers::pi), size(-1.5, 1.5);
  std::vector<AmplitudeRow> found;
  std::vector<Eigen::VectorXd> places;
  for (Index start = 0; start < kStartsOfPlane * planes * planes; ++start) {
    Eigen::VectorXd at(unknowns);
    at[0] = problem.read.mean();
    for (Index p = 0; p < planes; ++p) {
      const std::complex<double> a = std::polar(at[0] * std::exp(size(random)), turn(random));
      at[1 + 2 * p] = a.real();
      at[2 + 2 * p] = a.imag();
    }
    SquareSum sum;
    problem.linearise(at, sum);
    descend(problem, at, sum, 100);
    if (!std::isfinite(sum.cost)) continue;
    if (at[0] < 0) at = -at;
    const bool known = std::any_of(places.begin(), places.end(), [&](const Eigen::VectorXd& other) {
      return (other - at).norm() < 1e-3 * (1 + at.norm());
    });
    if (known) continue;
    const InverseInformation inverse = invert_information(sum.normal);
    if (inverse.covariance.size() == 0) continue;
    places.push_back(at);
    AmplitudeRow minimum;
    minimum.baseline = at[0] * scale.reading;
    minimum.influence.resize(planes);
    for (Index p = 0; p < planes; ++p)
      minimum.influence[p] = std::complex<double>(at[1 + 2 * p], at[2 + 2 * p]) * scale.reading / scale.mass;
    minimum.misfit = sum.cost * scale.reading * scale.reading;
    const Eigen::VectorXd residual = (problem.read - problem.vectors(at).cwiseAbs()) * scale.reading;
    Eigen::MatrixXd gain = inverse.covariance * problem.slope(at).transpose();
    gain.bottomRows(2 * planes) /= scale.mass;
    minimum.residual = Eigen::VectorXd::Zero(runs);
    minimum.gain = Eigen::MatrixXd::Zero(unknowns, runs);
    for (std::size_t k = 0; k < read.size(); ++k) {
      minimum.residual[read[k]] = residual[static_cast<Index>(k)];
      minimum.gain.col(read[k]) = gain.col(static_cast<Index>(k));
    }
    found.push_back(std::move(minimum));
  }
  if (found.empty())
    throw Error(
        fmt::format("{}: the amplitudes do not tell every plane's influence: make runs with a trial mass at "
                    "three angles on each plane",
                    name));
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.misfit < b.misfit; });
  return found;
}

/// Minima that the readings allow.
void keep_allowed(std::vector<AmplitudeRow>& minima, double spare, double level, double noise) {
  const double free = std::max(spare, 1.0);
  double limit = free * std::pow(std::max(kAmplitudeScatter * level, 3 * std::sqrt(minima.front().misfit / free)), 2);
  // Three standard deviations of what is stated.
  if (noise > 0) limit = std::max(minima.front().misfit * 1.000001, 9 * free * noise * noise);
  std::erase_if(minima, [&](const AmplitudeRow& m) { return m.misfit > limit; });
}

using Answer = std::vector<AmplitudeRow>;

double misfit_of(const Answer& answer) {
  double sum = 0;
  for (const AmplitudeRow& row : answer) sum += row.misfit;
  return sum;
}

Eigen::MatrixXcd influence_of(const Answer& answer) {
  Eigen::MatrixXcd a(static_cast<Index>(answer.size()), answer.front().influence.size());
  for (Index m = 0; m < a.rows(); ++m) a.row(m) = answer[static_cast<std::size_t>(m)].influence.transpose();
  return a;
}

Eigen::VectorXcd baseline_of(const Answer& answer) {
  Eigen::VectorXcd b(static_cast<Index>(answer.size()));
  for (Index m = 0; m < b.size(); ++m) b[m] = answer[static_cast<std::size_t>(m)].baseline;
  return b;
}

Eigen::VectorXcd masses_of(const Answer& answer) {
  return influence_of(answer).completeOrthogonalDecomposition().solve(-baseline_of(answer));
}

/// Combinations of the minima of the rows with different masses, the best fit first.
std::vector<Answer> answers_of(const std::vector<std::vector<AmplitudeRow>>& minima) {
  std::vector<Answer> answers = {{}};
  for (const std::vector<AmplitudeRow>& row : minima) {
    std::vector<Answer> longer;
    for (const Answer& begun : answers)
      for (const AmplitudeRow& minimum : row) {
        longer.push_back(begun);
        longer.back().push_back(minimum);
      }
    std::stable_sort(longer.begin(), longer.end(),
                     [](const Answer& a, const Answer& b) { return misfit_of(a) < misfit_of(b); });
    if (longer.size() > kMostAnswers) longer.resize(kMostAnswers);
    answers = std::move(longer);
  }
  std::vector<Answer> distinct;
  for (Answer& answer : answers) {
    const Eigen::VectorXcd w = masses_of(answer);
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Answer& other) {
      const Eigen::VectorXcd v = masses_of(other);
      return (v - w).norm() <= kSameAnswer * std::max(v.norm(), w.norm());
    });
    if (!known) distinct.push_back(std::move(answer));
  }
  return distinct;
}

}  // namespace

AmplitudeFit fit_amplitudes(const BalancingJob& job, const InfluenceOptions& options) {
  job.check();
  require_range("noise", options.noise, 0, 1e3, "m");
  const Scales scale = scales_of(job);
  const auto rows = static_cast<Index>(job.rows.size()), runs = static_cast<Index>(job.runs.size());
  std::vector<std::vector<AmplitudeRow>> minima;
  double spare = std::numeric_limits<double>::infinity();
  for (Index m = 0; m < rows; ++m) {
    minima.push_back(minima_of(job, m, scale));
    double read = 0, level = 0;
    for (const BalancingRun& run : job.runs)
      if (!std::isnan(run.vibration[m].real())) read += 1, level += std::norm(run.vibration[m]);
    const double own = read - 1 - 2 * static_cast<double>(job.planes.size());
    keep_allowed(minima.back(), own, std::sqrt(level / read), options.noise);
    spare = std::min(spare, own);
  }
  const std::vector<Answer> answers = answers_of(minima);
  AmplitudeFit result;
  result.rows = answers.front();
  InfluenceFit& fit = result.fit;
  fit.influence = influence_of(answers.front());
  fit.baseline = baseline_of(answers.front());
  fit.drift = Eigen::VectorXcd::Zero(rows);
  fit.speed = job.speed.empty() ? std::vector<int>(job.rows.size(), 0) : job.speed;
  fit.used.assign(job.runs.size(), true);
  fit.repeatability = fit.repeat_share = kNaN;
  fit.spare = options.noise > 0 ? std::numeric_limits<double>::infinity() : spare;
  fit.freedom = Eigen::VectorXd::Constant(rows, fit.spare);
  fit.scatter = Eigen::MatrixXcd::Identity(rows, rows) * options.noise * options.noise;
  if (!(options.noise > 0)) {
    Eigen::MatrixXd residual(runs, rows);
    for (Index m = 0; m < rows; ++m) residual.col(m) = result.rows[static_cast<std::size_t>(m)].residual;
    const double nothing = spare > 0 ? 1 / spare : kNaN;
    fit.scatter = (residual.transpose() * residual * nothing).cast<std::complex<double>>();
  }
  fit.noise = fit.scatter.diagonal().real().cwiseSqrt();
  for (std::size_t k = 1; k < answers.size(); ++k) {
    result.or_influence.push_back(influence_of(answers[k]));
    result.or_baseline.push_back(baseline_of(answers[k]));
  }
  if (!fit.noise.allFinite()) fit.summary.add({FindingCode::scatter_unknown, Consequence::warning});
  return result;
}

CorrectionUncertainty amplitude_uncertainty(const AmplitudeFit& amplitudes, const CorrectionProblem& problem,
                                            const std::vector<int>& planes, Criterion criterion,
                                            const Eigen::VectorXcd& masses) {
  constexpr double kStep = 1e-4;  // of the row's baseline and influence
  const auto kept = static_cast<Index>(planes.size()), runs = amplitudes.rows.front().gain.cols();
  const Eigen::MatrixXd scatter = amplitudes.fit.scatter.real();
  CorrectionUncertainty u;
  u.covariance = Eigen::MatrixXd::Constant(2 * kept, 2 * kept, kNaN);
  u.freedom = amplitudes.fit.spare;
  u.quantile = !(u.freedom > 0) ? kNaN : std::isinf(u.freedom) ? 1.959964 : students_t_quantile(u.freedom, 0.975);
  if (std::isnan(u.quantile)) return u;
  // By run: slope of the masses in the readings of the rows.
  std::vector<Eigen::MatrixXd> slope(static_cast<std::size_t>(runs), Eigen::MatrixXd::Zero(2 * kept, problem.rows()));
  const auto moved = [&](Index row, Index plane, std::complex<double> by) {
    CorrectionProblem changed = problem;
    if (plane < 0)
      changed.vibration[row] += by;
    else
      changed.influence(row, plane) += by;
    const Eigen::VectorXcd w = solve_correction(changed, criterion).masses;
    Eigen::VectorXd d(2 * kept);
    d << (w - masses).real(), (w - masses).imag();
    return d;
  };
  for (Index m = 0; m < problem.rows(); ++m) {
    const AmplitudeRow& row = amplitudes.rows[static_cast<std::size_t>(m)];
    const auto add = [&](Index unknown, Index plane, std::complex<double> by) {
      const Eigen::VectorXd d = (moved(m, plane, by) - moved(m, plane, -by)) / (2 * std::abs(by));
      for (Index r = 0; r < runs; ++r) slope[static_cast<std::size_t>(r)].col(m) += d * row.gain(unknown, r);
    };
    add(0, -1, kStep * row.baseline);
    for (Index k = 0; k < kept; ++k) {
      const Index p = planes[static_cast<std::size_t>(k)];
      const double step = kStep * std::abs(row.influence[p]);
      add(1 + 2 * p, k, step);
      add(2 + 2 * p, k, {0, step});
    }
  }
  u.covariance.setZero();
  for (const Eigen::MatrixXd& s : slope) u.covariance += s * scatter * s.transpose();
  return u;
}

}  // namespace whirl::diagnosis
