#include "whirl/identify/output_error_rotor.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "output_error/output_error_problem.hpp"
#include "whirl/core/error.hpp"

namespace whirl::identification {
namespace {

using detail::Complex;

// Solves the damped, diagonally scaled normal equations; false when they are not positive definite. A parameter without
// effect at this point stays (the pole of a mode whose participation is still zero).
bool solve(const Eigen::MatrixXd& normal, const Eigen::VectorXd& right, double damping, Eigen::VectorXd& step) {
  const Eigen::VectorXd scale = (normal.diagonal().array() > 0).select(normal.diagonal().cwiseSqrt(), 1.0);
  Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal();
  scaled.diagonal() = (normal.diagonal().array() > 0).select(scaled.diagonal(), 1.0);
  scaled.diagonal().array() += damping;
  const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
  if (llt.info() != Eigen::Success) return false;
  step = llt.solve(right.cwiseQuotient(scale)).cwiseQuotient(scale);
  return step.allFinite();
}

}  // namespace

Eigen::VectorXcd OutputErrorFit::read_main(std::size_t r) const { return detail::read_by(sensor, records[r].main); }

Eigen::Index OutputErrorFit::index(const std::string& name) const {
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? -1 : static_cast<Eigen::Index>(at - names.begin());
}

OutputErrorFit fit_output_error_rotor(const std::vector<RotorRecord>& records, const RotorModel& start,
                                      const OutputErrorOptions& options, const std::vector<Complex>& start_eps,
                                      double start_delay) {
  if (records.empty()) throw Error("records: at least one is needed");
  require_range("profile_degree", options.profile_degree, 0, 6);
  require_range("runout_harmonics", options.runout_harmonics, 0, 10);
  require_range("terms", static_cast<double>(options.terms.size()), 0, 10);
  require_range("max_iterations", options.max_iterations, 1, 1000);
  require_range("tolerance", options.tolerance, 1e-9, 10);
  if (!start_eps.empty() && start_eps.size() != records.size()) {
    throw Error::in_field("start_eps", fmt::format("{} values", start_eps.size()), "empty or one per record");
  }
  OutputErrorFit fit;
  fit.model = start;
  for (const RotorRecord& r : records) {
    if (r.summary.status == Status::unusable) {
      fit.summary.fail(fmt::format("{}: {}", r.source, r.summary.warnings.back()));
      return fit;
    }
  }

  detail::OutputErrorProblem problem(records, options, start.modes.size());
  detail::Point point;
  point.model = start;
  point.decays = options.decays;
  point.delay = start_delay;
  point.terms = options.terms;
  point.sensor = options.sensor;
  for (std::size_t r = 0; r < records.size(); ++r) {
    OutputErrorRecord o;
    o.eps = start_eps.empty() ? start.eps : start_eps[r];
    o.offset = start.offset;
    for (const ForcedMode& m : start.modes) {
      // Participations belong to start.eps; with another unbalance they scale with it.
      o.participation.push_back(start.eps == 0.0 ? m.participation : m.participation * (o.eps / start.eps));
    }
    o.decay.assign(2 * options.decays.size(), 0);
    o.runout.assign(2 * static_cast<std::size_t>(options.runout_harmonics), 0);
    point.records.push_back(std::move(o));
    point.profile.emplace_back(Eigen::VectorXd::Zero(options.profile_degree));
  }
  problem.start_state(point);

  Eigen::MatrixXd normal;
  Eigen::VectorXd right, step;
  double cost = problem.evaluate(point, &normal, &right);
  if (!std::isfinite(cost)) {
    fit.summary.fail("the simulation of the starting model diverges");
    return fit;
  }
  const double values = problem.values(), freedom = values - static_cast<double>(problem.size());
  double damping = 0;
  bool converged = false;
  for (fit.iterations = 0; fit.iterations < options.max_iterations && !converged;) {
    if (!solve(normal, right, damping, step)) {
      if (damping < 1) {
        damping = std::max(10 * damping, 1e-8);
        continue;
      }
      fit.summary.fail("the output-error equations are singular: some parameter does not act on these records");
      return fit;
    }
    ++fit.iterations;
    const double moved = step.dot(normal * step);  // squared step in standard deviations
    converged = damping < 1e-6 && moved < options.tolerance * options.tolerance * std::max(1.0, cost / freedom) *
                                              static_cast<double>(problem.size());
    detail::Point trial = point;
    for (Eigen::Index j = 0; j < problem.size(); ++j) {
      detail::move(trial, problem.parameters()[static_cast<std::size_t>(j)], step[j]);
    }
    if (converged) {
      if (const double c = problem.evaluate(trial, nullptr, nullptr); c <= cost * (1 + 1e-12)) {
        point = std::move(trial);
        cost = c;
      }
      break;
    }
    Eigen::MatrixXd next_normal;
    Eigen::VectorXd next_right;
    const double next = problem.evaluate(trial, &next_normal, &next_right);
    if (next < cost) {
      point = std::move(trial);
      normal = std::move(next_normal);
      right = std::move(next_right);
      cost = next;
      damping = damping < 1e-6 ? 0 : damping * 0.1;
    } else {
      damping = std::max(10 * damping, 1e-4);
      if (damping > 1e8) break;
    }
  }
  fit.summary.chi_square = cost / freedom;
  fit.summary.residual = std::sqrt(cost / values);
  if (!converged) fit.summary.warn(fmt::format("output error did not converge in {} steps", fit.iterations));

  if (!(normal.diagonal().minCoeff() > 0)) {
    fit.summary.fail("the output-error equations are singular: some parameter does not act on these records");
    return fit;
  }
  const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt();
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const double lowest = eigen.eigenvalues()[0], highest = eigen.eigenvalues()[problem.size() - 1];
  fit.summary.condition_number = lowest > 0 ? std::sqrt(highest / lowest) : INFINITY;
  if (!(lowest > 1e-13 * highest)) {
    fit.summary.fail(
        fmt::format("the output-error equations are singular (condition number {:.1e})", fit.summary.condition_number));
    return fit;
  }
  fit.covariance =
      scale.cwiseInverse().asDiagonal() *
      (eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose()) *
      scale.cwiseInverse().asDiagonal();
  fit.values.resize(problem.size());
  for (const detail::Parameter& q : problem.parameters()) {
    fit.values[static_cast<Eigen::Index>(fit.names.size())] = detail::value(point, q);
    fit.names.push_back(q.name);
  }
  fit.model = point.model;
  fit.model.eps = point.records[0].eps;
  fit.model.offset = point.records[0].offset;
  for (std::size_t k = 0; k < fit.model.modes.size(); ++k) {
    fit.model.modes[k].participation = point.records[0].participation[k];
  }
  fit.decays = point.decays;
  fit.delay = point.delay;
  fit.terms = point.terms;
  fit.sensor = point.sensor;
  fit.records = std::move(point.records);
  return fit;
}

}  // namespace whirl::identification
