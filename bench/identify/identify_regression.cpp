// Speed of the regressions on a rotor record: 15000 samples, 17 terms (paper eq. 24) and 87 (with 35 pole pairs).
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "whirl/expr/library.hpp"
#include "whirl/expr/tape.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/paper.hpp"
#include "whirl/regression/regression.hpp"
#include "whirl/rotor/simulate.hpp"
#include "whirl/signal/derivative.hpp"
#include "whirl/signal/filter.hpp"

namespace {
using namespace whirl;
constexpr double kPi = std::numbers::pi;
const std::vector<std::string> kNames{"X1", "X2", "X3", "X4", "X5", "X6", "t"};

RotorModel rotor_b_model() {
  RotorModel m;
  m.k1 = 8882.6;
  m.k2 = 2e8;
  m.c = 7.5;
  m.eps = 3e-4;
  return m;
}
AngleSignal run_down() { return rotor::angle_signal(rotor::SpeedProfile::run_down(2 * kPi * 40, 15.0), 1e-3, 15000); }

struct RotorB {
  Eigen::MatrixXd variables, targets;  // 15000 x 7; rates of the six states
  RotorB() {
    const AngleSignal angle = run_down();
    const rotor::Response r = rotor::simulate(rotor_b_model(), angle);
    const Eigen::Index n = r.z.size();
    variables.resize(n, 7);
    variables.col(0) = r.z.real();
    variables.col(1) = r.dz.real();
    variables.col(2) = r.z.imag();
    variables.col(3) = r.dz.imag();
    for (Eigen::Index i = 0; i < n; ++i) {
      variables(i, 4) = angle.beta[2 * i];
      variables(i, 5) = angle.omega[2 * i];
      variables(i, 6) = 1e-3 * static_cast<double>(i);
    }
    targets.resize(n, 6);
    for (int k = 0; k < 6; ++k) targets.col(k) = signal::smoothing_spline(variables.col(k), 1e-3, 0).first;
    std::mt19937_64 engine(1);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 6; ++k) {
      const double sd = 0.02 * targets.col(k).norm() / std::sqrt(static_cast<double>(n));
      for (double& v : targets.col(k)) v += sd * normal(engine);
    }
  }
};
const RotorB& rotor_b() {
  static const RotorB record;
  return record;
}
expr::Tape library(int terms) {
  std::vector<expr::Expr> e = expr::rotor_library();
  if (terms > 17) {
    std::vector<std::complex<double>> poles;
    for (int k = 1; k <= 35; ++k) poles.emplace_back(-0.5, 2 * kPi * (3.0 * k + 0.4));
    e = expr::union_library({e, expr::modal_library(poles)});
  }
  return expr::compile(e, kNames);
}
Eigen::MatrixXd theta_of(int terms) { return library(terms).evaluate(rotor_b().variables); }

void stlsq_six_equations(benchmark::State& state) {
  const Eigen::MatrixXd theta = theta_of(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    regression::GramAccumulator sums(theta.cols(), 6);
    sums.add(theta, rotor_b().targets);
    for (int k = 0; k < 6; ++k) benchmark::DoNotOptimize(regression::solve(sums.problem(k)).xi);
  }
}
void lasso_path_cv_two_equations(benchmark::State& state) {
  const Eigen::MatrixXd theta = theta_of(static_cast<int>(state.range(0)));
  const Eigen::MatrixXd y = rotor_b().targets(Eigen::all, std::vector<int>{1, 3});
  for (auto _ : state) {
    regression::GramAccumulator sums(theta.cols(), 2, 300);
    sums.add(theta, y);
    for (int k = 0; k < 2; ++k) {
      const regression::Problem p = sums.problem(k);
      benchmark::DoNotOptimize(
          regression::solve(p, {.method = "lasso", .selection = regression::Selection::cv, .lasso = {.debias = true}})
              .xi);
      benchmark::DoNotOptimize(regression::solve(p, {.method = "lspl"}).xi);
    }
  }
}
void hundred_bootstraps(benchmark::State& state) {
  const Eigen::MatrixXd theta = theta_of(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    regression::GramAccumulator sums(theta.cols(), 6, 300);
    sums.add(theta, rotor_b().targets);
    for (int k = 0; k < 6; ++k) {
      benchmark::DoNotOptimize(
          regression::solve(sums.problem(k), {.method = "ensemble", .ensemble = {.resamples = 100}}).xi);
    }
  }
}
void best_subset_one_equation(benchmark::State& state) {
  const regression::Problem p = regression::make_problem(theta_of(17), rotor_b().targets.col(1));
  for (auto _ : state) benchmark::DoNotOptimize(regression::solve(p, {.method = "best_subset"}).xi);
}
/// 1.5 million samples streamed: library evaluated block by block, six equations.
void million_rows(benchmark::State& state) {
  const expr::Tape tape = library(17);
  for (auto _ : state) {
    regression::GramAccumulator sums(17, 6);
    Eigen::MatrixXd block(5000, 17);
    for (int repeat = 0; repeat < 100; ++repeat) {
      for (int b = 0; b < 3; ++b) {
        tape.evaluate(rotor_b().variables.middleRows(5000 * b, 5000), block);
        sums.add(block, rotor_b().targets.middleRows(5000 * b, 5000));
      }
    }
    for (int k = 0; k < 6; ++k) benchmark::DoNotOptimize(regression::solve(sums.problem(k)).xi);
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["peak_MB"] = static_cast<double>(usage.ru_maxrss) / 1024;
}
void derivative_of_six_columns(benchmark::State& state) {
  const Eigen::MatrixXd& x = rotor_b().variables;
  for (auto _ : state) {
    for (int k = 0; k < 6; ++k)
      benchmark::DoNotOptimize(signal::central_difference(signal::gaussian_filter(x.col(k), 4), 1e-3, 4));
  }
}
IdentifiedModel eq24_model() {
  IdentifiedModel m;
  m.states = {"X1", "X2", "X3", "X4"};
  m.inputs = {"X5", "X6"};
  const auto axis = [](const char* lhs, const char* x, const char* v, const char* trig, const char* other) {
    Equation e{lhs, {}};
    const auto add = [&](double c, std::string f) {
      Estimate value;
      value.value = c;
      e.terms.push_back({std::move(f), value, ""});
    };
    for (const expr::Expr& term : expr::rotor_library()) add(1e-9, term.str());
    add(-8882.6, x);
    add(-2e8, std::string(x) + "^3");
    add(-2e8, other);
    add(-7.5, v);
    add(3e-4, std::string("X6^2*") + trig);
    return e;
  };
  m.equations = {axis("X2'", "X1", "X2", "cos(X5)", "X1*X3^2"), axis("X4'", "X3", "X4", "sin(X5)", "X1^2*X3")};
  return m;
}
void simulate_fifteen_seconds(benchmark::State& state) {
  const identification::CompiledModel model(eq24_model());
  const AngleSignal angle = run_down();
  const Eigen::MatrixXd inputs = identification::half_grid_inputs(model, angle);
  const Eigen::VectorXd start = rotor_b().variables.row(0).head(4);
  for (auto _ : state) {
    const identification::ModelRun run = simulate(model, inputs, start, 1e-3, 15000);
    if (run.diverged) state.SkipWithError("diverged");
    benchmark::DoNotOptimize(run.values.data());
  }
}
void right_hand_side_one_state(benchmark::State& state) {
  const identification::CompiledModel model(eq24_model());
  double in[6] = {1e-3, 0.1, 2e-3, 0.2, 3.0, 200.0}, out[4];
  for (auto _ : state) {
    model.rate(in, out);
    benchmark::DoNotOptimize(out);
  }
}

/// Weak form, output error, score test and intervals of a 15 s run-down at 20 dB.
void default_identification(benchmark::State& state) {
  const AngleSignal angle = run_down();
  Recording r = rotor::simulate(rotor_b_model(), angle).recording();
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  for (Channel& c : r.channels) {
    const double sd = 0.1 * std::sqrt((c.samples.array() - c.samples.mean()).square().mean());
    for (double& v : c.samples) v += sd * normal(engine);
  }
  Eigen::VectorXd beta(r.size());
  for (Eigen::Index i = 0; i < r.size(); ++i) beta[i] = angle.beta[2 * i];
  r.add("beta", Quantity::angle, beta);
  for (auto _ : state) benchmark::DoNotOptimize(identification::identify_rotor(r).rotor->k1);
}
/// The five-parameter rotor over 15 s.
void simulate_rotor_fifteen_seconds(benchmark::State& state) {
  const AngleSignal angle = run_down();
  for (auto _ : state) benchmark::DoNotOptimize(rotor::simulate(rotor_b_model(), angle).z.data());
}

BENCHMARK(stlsq_six_equations)->Arg(17)->Arg(87)->Unit(benchmark::kMillisecond);
BENCHMARK(lasso_path_cv_two_equations)->Arg(17)->Arg(87)->Unit(benchmark::kMillisecond);
BENCHMARK(hundred_bootstraps)->Arg(17)->Arg(87)->Unit(benchmark::kMillisecond);
BENCHMARK(best_subset_one_equation)->Unit(benchmark::kMillisecond);
BENCHMARK(derivative_of_six_columns)->Unit(benchmark::kMillisecond);
BENCHMARK(simulate_fifteen_seconds)->Unit(benchmark::kMillisecond);
BENCHMARK(simulate_rotor_fifteen_seconds)->Unit(benchmark::kMillisecond);
BENCHMARK(default_identification)->Unit(benchmark::kMillisecond);
BENCHMARK(right_hand_side_one_state);
BENCHMARK(million_rows)->Unit(benchmark::kMillisecond);
}  // namespace

BENCHMARK_MAIN();
