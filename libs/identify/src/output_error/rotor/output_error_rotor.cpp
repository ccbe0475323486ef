#include "whirl/identify/output_error_rotor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "output_error/rotor/output_error_problem.hpp"
#include "whirl/core/error.hpp"

namespace whirl::identification {
namespace {

using detail::Complex;

void check(const std::vector<RotorRecord>& records, const OutputErrorOptions& options,
           const std::vector<Complex>& start_eps) {
  if (records.empty()) throw Error("records: at least one is needed");
  require_range("profile_degree", options.clock.profile_degree, 0, 6);
  require_range("runout_harmonics", options.probes.runout_harmonics, 0, 10);
  require_range("terms", static_cast<double>(options.terms.size()), 0, 10);
  require_range("substeps", options.solver.substeps, 0, 16);
  require_range("max_iterations", options.solver.max_iterations, 1, 1000);
  require_range("tolerance", options.solver.tolerance, 1e-9, 10);
  for (const auto* changes : {&options.changes.k1, &options.changes.c}) {
    if (!changes->empty() && changes->size() != records.size())
      throw Error::in_field("record_k1, record_c", fmt::format("{} values", changes->size()),
                            "empty or one per record");
  }
  if (!start_eps.empty() && start_eps.size() != records.size()) {
    throw Error::in_field("start_eps", fmt::format("{} values", start_eps.size()), "empty or one per record");
  }
}

detail::Point start_point(const std::vector<double>& times, const RotorModel& start, const OutputErrorOptions& options,
                          const std::vector<Complex>& start_eps, double start_delay) {
  detail::Point point;
  point.model = start;
  point.decays = options.modes.decays;
  point.delay = start_delay;
  point.clock_drift = options.clock.start_drift;
  point.terms = options.terms;
  point.sensor = options.probes.start;
  for (std::size_t r = 0; r < times.size(); ++r) {
    OutputErrorRecord o;
    o.t0 = times[r];
    o.eps = start_eps.empty() ? start.eps : start_eps[r];
    o.offset = start.offset;
    if (!options.changes.k1.empty()) o.k1_change = options.changes.k1[r];
    if (!options.changes.c.empty()) o.c_change = options.changes.c[r];
    for (const ForcedMode& m : start.modes) {
      // Participations belong to start.eps; with another unbalance they scale with it.
      o.participation.push_back(start.eps == 0.0 ? m.participation : m.participation * (o.eps / start.eps));
    }
    o.decay.assign(2 * options.modes.decays.size(), 0);
    o.runout.assign(2 * static_cast<std::size_t>(options.probes.runout_harmonics), 0);
    point.records.push_back(std::move(o));
    point.profile.emplace_back(Eigen::VectorXd::Zero(options.clock.profile_degree));
  }
  return point;
}

/// The estimate and what its parameters are called.
void take_over(const std::vector<detail::Parameter>& parameters, detail::Point&& point, OutputErrorFit& fit) {
  fit.values.resize(static_cast<Eigen::Index>(parameters.size()));
  for (const detail::Parameter& q : parameters) {
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
  fit.clock_drift = point.clock_drift;
  fit.terms = point.terms;
  fit.sensor = point.sensor;
  fit.records = std::move(point.records);
}

}  // namespace

Eigen::VectorXcd OutputErrorFit::read_main(std::size_t r) const {
  return detail::read_by(sensor, records[r].as_read(), {records[r].t0, records[r].angle.dt});
}

Eigen::Index OutputErrorFit::index(const std::string& name) const {
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? -1 : static_cast<Eigen::Index>(at - names.begin());
}

OutputErrorFit detail::fit_with_forces(const std::vector<RotorRecord>& records, const RotorModel& start,
                                       const OutputErrorOptions& options, const std::vector<Complex>& start_eps,
                                       double start_delay, const KnownForces& forces) {
  check(records, options, start_eps);
  OutputErrorFit fit;
  fit.model = start;
  for (const RotorRecord& r : records) {
    if (r.summary.status == Status::unusable) {
      fit.summary.fail(fmt::format("{}: {}", r.source, r.summary.reason));
      return fit;
    }
  }

  std::vector<double> times;
  for (const RotorRecord& r : records) times.push_back(r.t0);
  detail::Point point = start_point(times, start, options, start_eps, start_delay);
  OutputErrorOptions used = options;
  used.solver.substeps = std::max(1, options.solver.substeps);
  std::optional<detail::OutputErrorProblem> problem;
  problem.emplace(records, used, start.modes.size(), forces);
  problem->start_state(point);
  detail::OutputError found = detail::fit_output_error(*problem, point, options.solver.max_iterations);
  if (options.solver.substeps == 0 && !found.diverged)
    used.solver.substeps = problem->substeps_needed(point, found.variance());
  if (used.solver.substeps > 1 && options.solver.substeps == 0) {
    problem.emplace(records, used, start.modes.size(), forces);
    found = detail::fit_output_error(*problem, point, options.solver.max_iterations);
  }
  if (found.diverged) {
    fit.summary.fail("the simulation of the starting model diverges");
    return fit;
  }
  fit.iterations = found.descent.iterations;
  fit.summary.chi_square = found.variance();
  fit.summary.residual = std::sqrt(found.sum.cost / found.values);
  if (found.descent.end == Descent::singular || !(found.sum.normal.diagonal().minCoeff() > 0)) {
    fit.summary.fail("the output-error equations are singular: some parameter does not act on these records");
    return fit;
  }
  if (found.descent.end != Descent::converged) {
    fit.summary.warn(fmt::format("output error did not converge in {} steps", fit.iterations));
  }
  InverseInformation inverse = invert_information(found.sum.normal);
  fit.summary.condition_number = inverse.condition_number;
  if (inverse.covariance.size() == 0) {
    fit.summary.fail(
        fmt::format("the output-error equations are singular (condition number {:.1e})", fit.summary.condition_number));
    return fit;
  }
  fit.covariance = std::move(inverse.covariance);
  take_over(problem->parameters(), std::move(point), fit);
  fit.substeps = used.solver.substeps;
  return fit;
}

detail::Point detail::point_of(const OutputErrorFit& fit, const OutputErrorOptions& options,
                               const std::vector<Parameter>& parameters) {
  std::vector<double> times;
  for (const OutputErrorRecord& r : fit.records) times.push_back(r.t0);
  Point point = start_point(times, fit.model, options, {}, fit.delay);
  for (std::size_t r = 0; r < fit.records.size(); ++r) {
    const OutputErrorRecord& from = fit.records[r];
    OutputErrorRecord& to = point.records[r];
    to.eps = from.eps, to.offset = from.offset, to.z0 = from.z0, to.dz0 = from.dz0;
    to.participation = from.participation, to.decay = from.decay, to.runout = from.runout;
  }
  for (const Parameter& q : parameters) {
    if (const Eigen::Index j = fit.index(q.name); j >= 0) move(point, q, fit.values[j] - value(point, q));
  }
  return point;
}

OutputErrorFit fit_output_error_rotor(const std::vector<RotorRecord>& records, const RotorModel& start,
                                      const OutputErrorOptions& options, const std::vector<Complex>& start_eps,
                                      double start_delay) {
  return detail::fit_with_forces(records, start, options, start_eps, start_delay, {});
}

}  // namespace whirl::identification
