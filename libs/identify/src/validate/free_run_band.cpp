#include "validate/free_run_band.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

namespace whirl::identification::detail {
namespace {

/// Steps of the estimated coefficients: jointly where their covariance is known, else each by its own interval.
Eigen::MatrixXd steps_of(const IdentifiedModel& model) {
  std::vector<double> sd;
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      if (t.coefficient.sd != 0) sd.push_back(std::isfinite(t.coefficient.sd) ? t.coefficient.sd : 0);
    }
  }
  const auto p = static_cast<Eigen::Index>(sd.size());
  const Eigen::Map<const Eigen::VectorXd> own(sd.data(), p);
  if (p == 0 || model.parameter_covariance.size() != static_cast<std::size_t>(p * p)) return own.asDiagonal();
  const Eigen::MatrixXd covariance = Eigen::Map<const Eigen::MatrixXd>(model.parameter_covariance.data(), p, p);
  if (!covariance.allFinite()) return own.asDiagonal();
  const Eigen::VectorXd by = own.unaryExpr([](double s) { return s > 0 ? 1 / s : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      Eigen::MatrixXd(by.asDiagonal() * covariance * by.asDiagonal()));
  return own.asDiagonal() * eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

void move(const Eigen::VectorXd& change, IdentifiedModel& model) {
  Eigen::Index i = 0;
  for (Equation& e : model.equations) {
    for (EquationTerm& t : e.terms) {
      if (t.coefficient.sd != 0) t.coefficient.value += change[i++];
    }
  }
}

}  // namespace

Eigen::VectorXd free_run_spread(const IdentifiedModel& model, const Recording& record,
                                const std::vector<StateScore>& scores) {
  constexpr int kDraws = 8;
  std::mt19937_64 engine(1);
  std::normal_distribution<double> gauss;
  const auto n = static_cast<Eigen::Index>(scores.size());
  const Eigen::MatrixXd steps = steps_of(model);
  const ModelRun given = simulate(model, record);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(n);
  for (int d = 0; d < kDraws; ++d) {
    IdentifiedModel drawn = model;
    move(steps * Eigen::VectorXd::NullaryExpr(steps.cols(), [&] { return gauss(engine); }), drawn);
    for (InputTiming& t : drawn.timing) {
      if (t.dead_time.sd > 0) t.dead_time.value = std::max(0.0, t.dead_time.value + t.dead_time.sd * gauss(engine));
    }
    Recording noisier = record;
    for (const StateScore& s : scores) {
      for (Channel& c : noisier.channels) {
        if (c.name != s.state) continue;
        const double correlation = model.noise_correlation_of(s.state);
        double noise = gauss(engine);
        for (double& v : c.samples) {
          v += s.noise * noise;
          noise = correlation * noise + std::sqrt(1 - correlation * correlation) * gauss(engine);
        }
      }
    }
    const ModelRun run = simulate(drawn, noisier);
    if (given.diverged || run.diverged) return Eigen::VectorXd::Constant(n, INFINITY);
    for (Eigen::Index k = 0; k < n; ++k) {
      const std::string& state = scores[static_cast<std::size_t>(k)].state;
      squares[k] += (run.state(state) - given.state(state)).squaredNorm() / static_cast<double>(record.size());
    }
  }
  return (squares / kDraws).cwiseSqrt();
}

}  // namespace whirl::identification::detail
