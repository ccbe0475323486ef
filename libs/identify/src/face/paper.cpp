#include "whirl/identify/paper.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <complex>

#include "evidence/compare_all.hpp"
#include "problem/paper_parameters.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/signal/derivative.hpp"
#include "whirl/signal/filter.hpp"

namespace whirl::identification {
namespace {

const std::vector<std::string> kVariables{"X1", "X2", "X3", "X4", "X5", "X6", "X7", "t"};
constexpr Eigen::Index kLost = 4;  // samples lost at each end by differencing twice with eq. 15

/// States and accelerations at samples first .. first + rows - 1 of the record.
struct Derivatives {
  Eigen::Index first = 0;
  Eigen::MatrixXd variables;  // kVariables
  Eigen::MatrixXd target;     // x'', y''
};

/// `sd` in samples filters the data; `again` also each derivative.
Derivatives differentiate_record(const RotorRecord& record, double sd, bool again) {
  const Eigen::Index n = record.size() - 2 * kLost;
  if (n < 16) throw Error::in_field("samples in the record", std::to_string(record.size()), "at least 24");
  Derivatives d;
  d.first = kLost;
  d.variables.resize(n, static_cast<Eigen::Index>(kVariables.size()));
  d.target.resize(n, 2);
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::VectorXd raw = axis == 0 ? Eigen::VectorXd(record.z.real()) : Eigen::VectorXd(record.z.imag());
    const Eigen::VectorXd x = signal::gaussian_filter(raw, sd);
    Eigen::VectorXd v = signal::central_difference(x, record.dt, 4);
    if (again) v = signal::gaussian_filter(v, sd);
    Eigen::VectorXd a = signal::central_difference(v, record.dt, 4);
    if (again) a = signal::gaussian_filter(a, sd);
    d.variables.col(2 * axis) = x.segment(kLost, n);
    d.variables.col(2 * axis + 1) = v.segment(kLost / 2, n);
    d.target.col(axis) = a;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index at = 2 * (i + kLost);
    d.variables(i, 4) = record.angle.beta[at];
    d.variables(i, 5) = record.angle.omega[at];
    d.variables(i, 6) = record.angle.alpha[at];
    d.variables(i, 7) = record.dt * static_cast<double>(i + kLost);
  }
  return d;
}

IdentifiedModel rotor_shell(const RotorRecord& record, std::string method) {
  IdentifiedModel model;
  model.method = std::move(method);
  model.states = {"X1", "X2", "X3", "X4"};
  model.equations = {
      {"X1'", {{"X2", {1, 0, 1, 1}, "1"}}}, {"X2'", {}}, {"X3'", {{"X4", {1, 0, 1, 1}, "1"}}}, {"X4'", {}}};
  model.sample_time = record.dt;
  model.noise_sd = std::sqrt(0.5 * record.noise_variance());
  model.provenance.version = std::string(version());
  if (record.usable_x.size() > 0) {
    model.summary.warn("this method cannot leave samples out: it takes the curve through their neighbours as measured");
  }
  model.provenance.inputs = {record.source};
  return model;
}

/// Inputs are the names that the kept terms use.
void set_inputs(IdentifiedModel& model) {
  for (const char* name : {"X5", "X6", "X7", "t"}) {
    const bool used = std::any_of(model.equations.begin(), model.equations.end(), [&](const Equation& e) {
      return std::any_of(e.terms.begin(), e.terms.end(), [&](const EquationTerm& t) {
        const std::vector<std::string> names = expr::variables(expr::Expr::parse(t.function));
        return std::find(names.begin(), names.end(), name) != names.end();
      });
    });
    if (used) model.inputs.push_back(name);
  }
}

/// Free run of the library model from the first usable sample; rmse against the measured displacement.
void simulate_training(IdentifiedModel& model, const RotorRecord& record, Eigen::Index first,
                       const Eigen::VectorXd& start) {
  const CompiledModel compiled(model);
  const Eigen::Index n = record.size() - first;
  AngleSignal angle{record.dt, record.angle.beta.tail(2 * n - 1), record.angle.omega.tail(2 * n - 1),
                    record.angle.alpha.tail(2 * n - 1)};
  const Eigen::MatrixXd inputs = half_grid_inputs(compiled, angle, record.dt * static_cast<double>(first));
  const double largest = record.z.cwiseAbs().maxCoeff();
  const ModelRun run = simulate(compiled, inputs, start, record.dt, n,
                                1e3 * std::max(largest, 1e-12) * std::max(1.0, record.speed_high()));
  if (run.diverged || run.state("X1").cwiseAbs().maxCoeff() > 1e3 * largest ||
      run.state("X3").cwiseAbs().maxCoeff() > 1e3 * largest) {
    model.summary.fail(fmt::format("the free run of the identified model diverges {:.3g} s after its start",
                                   record.dt * static_cast<double>(run.valid)));
    return;
  }
  const double rows = std::sqrt(static_cast<double>(n));
  const double rmse_x = (run.state("X1") - record.z.real().tail(n)).norm() / rows;
  const double rmse_y = (run.state("X3") - record.z.imag().tail(n)).norm() / rows;
  Estimate e;
  e.value = rmse_x;
  model.parameters.emplace_back("rmse_x", e);
  e.value = rmse_y;
  model.parameters.emplace_back("rmse_y", e);
  model.summary.residual = std::hypot(rmse_x, rmse_y) / std::sqrt(2.0);
  model.summary.chi_square = 0.5 * (std::pow(rmse_x / record.noise_x, 2) + std::pow(rmse_y / record.noise_y, 2));
}

/// State at sample `first`: where the rotor turns at least once in 100 samples from the fit of 1, e^{i beta}, e^{-i
/// beta} to them, else `filtered` (a filter attenuates the whirl and so its start).
Eigen::VectorXd start_state(const RotorRecord& record, Eigen::Index first, const Eigen::VectorXd& filtered) {
  constexpr Eigen::Index rows = 100;
  if (first + rows > record.size()) return filtered;
  const auto beta = [&](Eigen::Index i) { return record.angle.beta[2 * (first + i)]; };
  if (std::abs(beta(rows - 1) - beta(0)) < 6.3) return filtered;
  Eigen::MatrixXcd basis(rows, 3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    basis.row(i) << 1.0, std::polar(1.0, beta(i)), std::polar(1.0, -beta(i));
  }
  const Eigen::VectorXcd p = Eigen::MatrixXcd(basis.adjoint() * basis)
                                 .ldlt()
                                 .solve(Eigen::VectorXcd(basis.adjoint() * record.z.segment(first, rows)));
  const std::complex<double> forward = p[1] * std::polar(1.0, beta(0)), backward = p[2] * std::polar(1.0, -beta(0));
  const std::complex<double> z = p[0] + forward + backward;
  const std::complex<double> dz = std::complex<double>(0, record.angle.omega[2 * first]) * (forward - backward);
  return (Eigen::VectorXd(4) << z.real(), dz.real(), z.imag(), dz.imag()).finished();
}

/// The record's verdict, when nothing can be identified from it.
bool unusable(const RotorRecord& record, IdentifiedModel& model) {
  model.summary.take(record.summary);
  if (record.summary.status != Status::unusable) return false;
  model.states.clear();
  model.equations.clear();
  return true;
}

}  // namespace

namespace {

/// The chain up to the regression: everything that does not depend on the method of `solve`.
struct PaperRegression {
  std::vector<expr::Expr> terms;
  std::vector<std::string> names;
  regression::Problem problem[2];  // x'', y''
  Eigen::Index first = 0;
  Eigen::VectorXd start;
};

PaperRegression prepare(const RotorRecord& record, const PaperOptions& options) {
  require_range("filter width", options.filter_sd, 0, 0.1, "s");
  PaperRegression r;
  r.terms = options.library.empty() ? expr::rotor_library() : expr::parse_library(options.library);
  if (!options.poles.empty()) r.terms = expr::union_library({r.terms, expr::modal_library(options.poles)});
  for (const expr::Expr& e : r.terms) r.names.push_back(e.str());

  const double sd = options.filter_sd / record.dt;
  const bool whole_equation = options.filter == PaperFilter::equation;
  const bool again = options.filter == PaperFilter::data_and_derivative;
  const Derivatives d = differentiate_record(record, whole_equation ? 0 : sd, again);
  Eigen::MatrixXd theta = expr::compile(r.terms, kVariables).evaluate(d.variables);
  Eigen::MatrixXd target = d.target;
  r.first = d.first;
  r.start = d.variables.row(0).head(4);
  if (whole_equation) {
    const Eigen::Index reach = signal::gaussian_reach(sd);
    const Eigen::Index inside = theta.rows() - 2 * reach;
    if (inside < 16)
      throw Error::in_field("filter width", fmt::format("{} s", options.filter_sd), "far below the record");
    theta = signal::gaussian_filter_columns(theta, sd).middleRows(reach, inside).eval();
    target = signal::gaussian_filter_columns(target, sd).middleRows(reach, inside).eval();
    r.start = signal::gaussian_filter_columns(d.variables.leftCols(4), sd).row(reach);
    r.first += reach;
  }
  constexpr int blocks = 50;
  regression::GramAccumulator sums(theta.cols(), 2, std::max<Eigen::Index>(1, (theta.rows() + blocks - 1) / blocks));
  sums.add(theta, target);
  for (int axis = 0; axis < 2; ++axis) r.problem[axis] = sums.problem(axis, r.names);
  return r;
}

/// Sparse regression per axis; summary.residual is the larger rms residual by the rms of its left-hand side.
IdentifiedModel regress(const RotorRecord& record, const PaperRegression& r, const regression::SolveOptions& solver) {
  IdentifiedModel model = rotor_shell(record, "paper");
  for (const std::string& w : record.summary.warnings) model.summary.warn(w);
  model.summary.condition_number = model.summary.residual = 0;
  for (int axis = 0; axis < 2; ++axis) {
    const regression::SparseFit fit = regression::solve(r.problem[axis], solver);
    Equation& equation = model.equations[static_cast<std::size_t>(2 * axis + 1)];
    for (int j : fit.support) {
      const expr::Expr& term = r.terms[static_cast<std::size_t>(j)];
      equation.terms.push_back({r.names[static_cast<std::size_t>(j)], Estimate::from_sd(fit.xi[j], fit.sd[j]),
                                expr::coefficient_unit(term, expr::Unit::parse("m/s^2"), expr::rotor_units())});
    }
    model.summary.condition_number = std::fmax(model.summary.condition_number, fit.summary.condition_number);
    model.summary.residual = std::fmax(model.summary.residual, fit.summary.residual);
    for (const std::string& w : fit.summary.warnings) model.summary.warn(equation.lhs + ": " + w);
  }
  set_inputs(model);
  detail::add_rotor_parameters(model);
  return model;
}

}  // namespace

IdentifiedModel identify_paper(const RotorRecord& record, const PaperOptions& options) {
  IdentifiedModel model = rotor_shell(record, "paper");
  if (unusable(record, model)) return model;
  const PaperRegression r = prepare(record, options);
  model = regress(record, r, options.solver);
  simulate_training(model, record, r.first, start_state(record, r.first, r.start));
  model.summary.trust =
      "Reproduction of the published chain: a small error of the training run does not validate the coefficients, "
      "which "
      "one-sided filtering biases by tens of percent; use the weak form for a model.";
  model.provenance.options =
      fmt::format("filter_sd={:g} solver={} terms={}", options.filter_sd, options.solver.method, r.terms.size());
  return model;
}

IdentifiedModel identify_paper(const Recording& recording, const PaperOptions& options) {
  return identify_paper(rotor_record(recording, options.record), options);
}

std::vector<ComparedFit> compare_regressors(const RotorRecord& record, const PaperOptions& options) {
  IdentifiedModel model;
  if (unusable(record, model)) throw Error(model.summary.reason);
  const PaperRegression r = prepare(record, options);
  return detail::compare_all(r.terms.size(), options.solver,
                             [&](const regression::SolveOptions& solver) { return regress(record, r, solver); });
}

IdentifiedModel identify_consistent(const RotorRecord& record, const ConsistentOptions& options) {
  require_range("filter width", options.filter_sd, 0, 0.1, "s");
  IdentifiedModel model = rotor_shell(record, "consistent");
  if (unusable(record, model)) return model;
  const expr::CandidateLibrary library = expr::tied_rotor_library(options.offset);
  const double sd = options.filter_sd / record.dt;
  const Derivatives d = differentiate_record(record, 0, false);
  const Eigen::Index reach = signal::gaussian_reach(sd);
  const Eigen::Index inside = d.target.rows() - 2 * reach;
  if (inside < 16)
    throw Error::in_field("filter width", fmt::format("{} s", options.filter_sd), "far below the record");

  const Eigen::Index unknowns = static_cast<Eigen::Index>(library.groups.size());
  std::vector<regression::Problem> problems;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    // Each unknown's column: the sum of its entries in this equation.
    std::vector<expr::Expr> columns;
    for (const expr::TiedGroup& group : library.groups) {
      std::vector<expr::Expr> entries;
      for (const expr::TiedEntry& e : group.entries) {
        if (e.equation == axis) entries.push_back(expr::Expr(e.factor) * e.function);
      }
      columns.push_back(expr::Expr::sum(entries));
    }
    Eigen::MatrixXd theta = expr::compile(columns, kVariables).evaluate(d.variables);
    // E[|z + n|^2 (z + n)] = |z|^2 z + 2 s2 z (s2 = noise variance of z): remove it from the k2 column (-|z|^2 z).
    theta.col(1) += 2 * record.noise_variance() * d.variables.col(axis == 0 ? 0 : 2);
    const Eigen::MatrixXd filtered = signal::gaussian_filter_columns(theta, sd).middleRows(reach, inside);
    const Eigen::VectorXd target =
        signal::gaussian_filter(d.target.col(static_cast<Eigen::Index>(axis)), sd).segment(reach, inside);
    regression::Problem p = regression::make_problem(filtered, target, 50);
    // Rows of a filtered equation are correlated over the kernel: one independent row per 2 sqrt(pi) sd samples.
    p.effective_rows = p.total.rows / std::max(1.0, 3.545 * sd);
    problems.push_back(std::move(p));
  }
  const regression::SparseFit fit = regression::solve(regression::stack(problems), {.method = "ols"});

  for (Eigen::Index j = 0; j < unknowns; ++j) {
    const expr::TiedGroup& group = library.groups[static_cast<std::size_t>(j)];
    for (const expr::TiedEntry& e : group.entries) {
      model.equations[2 * e.equation + 1].terms.push_back(
          {e.function.str(), Estimate::from_sd(e.factor * fit.xi[j], fit.sd[j]), group.unit});
    }
  }
  RotorModel rotor;
  rotor.k1 = fit.xi[0];
  rotor.k2 = fit.xi[1];
  rotor.c = fit.xi[2];
  rotor.eps = {fit.xi[3], fit.xi[4]};
  if (options.offset && rotor.k1 != 0) rotor.offset = std::complex<double>(fit.xi[5], fit.xi[6]) / rotor.k1;
  model.rotor = rotor;
  for (int j = 0; j < 3; ++j) {
    model.parameters.emplace_back(library.groups[static_cast<std::size_t>(j)].name,
                                  Estimate::from_sd(fit.xi[j], fit.sd[j]));
  }
  const double e = std::abs(rotor.eps);
  const double cos = e > 0 ? rotor.eps.real() / e : 1, sin = e > 0 ? rotor.eps.imag() / e : 0;
  model.parameters.emplace_back("e", Estimate::from_sd(e, std::hypot(cos * fit.sd[3], sin * fit.sd[4])));
  model.parameters.emplace_back(
      "e_phase", Estimate::from_sd(std::arg(rotor.eps), e > 0 ? std::hypot(sin * fit.sd[3], cos * fit.sd[4]) / e : 0));
  set_inputs(model);
  model.summary.condition_number = fit.summary.condition_number;
  for (const std::string& w : fit.summary.warnings) model.summary.warn(w);
  const Eigen::VectorXd start = signal::gaussian_filter_columns(d.variables.leftCols(4), sd).row(reach);
  simulate_training(model, record, d.first + reach, start_state(record, d.first + reach, start));
  model.summary.trust = "Simple mode: within a small factor of the weak form when the filter width suits the noise.";
  model.provenance.options = fmt::format("filter_sd={:g}", options.filter_sd);
  return model;
}

IdentifiedModel identify_consistent(const Recording& recording, const ConsistentOptions& options) {
  return identify_consistent(rotor_record(recording, options.record), options);
}

}  // namespace whirl::identification
