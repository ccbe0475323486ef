// Promise: a full curve of the anisotropic rotor with stability, 5 harmonics, in under 20 ms; 1000 curves over the
// covariance, of the isotropic and of the anisotropic rotor, in under 5 s.
#include <benchmark/benchmark.h>

#include <random>

#include "whirl/response/continuation.hpp"
#include "whirl/response/curve_band.hpp"
#include "whirl/response/sweep_peaks.hpp"
#include "whirl/response/synchronous.hpp"

namespace {

using namespace whirl;

RotorModel rotor() {
  RotorModel m;
  m.k1 = 8882.6;
  m.k2 = 2e8;
  m.c = 7.5;
  m.eps = 3e-4;
  return m;
}

void AnisotropicCurve(benchmark::State& state) {
  RotorModel m = rotor();
  m.k1_conj = {300, 120};
  const response::PeriodicSystem system(response::rotor_equations(m), {});
  response::CurveOptions o;
  o.from = 40;
  o.to = 200;
  std::size_t points = 0;
  for (auto _ : state) points = response::response_curve(system, response::Parameter::speed, 0, o).points.size();
  state.counters["points"] = static_cast<double>(points);
}
BENCHMARK(AnisotropicCurve)->Unit(benchmark::kMillisecond);

void ThousandSynchronousCurves(benchmark::State& state) {
  std::vector<double> covariance(25, 0.0);
  const double sd[5] = {20, 2e6, 0.1, 1e-6, 1e-6};
  for (int k = 0; k < 5; ++k) covariance[static_cast<std::size_t>(6 * k)] = sd[k] * sd[k];
  const Eigen::VectorXd omega = Eigen::VectorXd::LinSpaced(300, 40, 200);
  for (auto _ : state) benchmark::DoNotOptimize(response::synchronous_band(rotor(), covariance, omega, 1000).peak_high);
}
BENCHMARK(ThousandSynchronousCurves)->Unit(benchmark::kMillisecond);

void ThousandAnisotropicCurves(benchmark::State& state) {
  RotorModel m = rotor();
  m.k1_conj = {300, 120};
  const response::PeriodicSystem system(response::rotor_equations(m), {});
  response::CurveOptions o;
  o.from = 40;
  o.to = 200;
  const std::vector<response::ResponseCurve> curves{response::response_curve(system, response::Parameter::speed, 0, o)};
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const auto draw = [&]() -> std::optional<response::PeriodicSystem> {
    RotorModel drawn = m;
    drawn.k1 += 20 * normal(random);
    drawn.k2 += 2e6 * normal(random);
    drawn.c += 0.1 * normal(random);
    drawn.k1_conj += std::complex<double>(10 * normal(random), 10 * normal(random));
    drawn.eps += std::complex<double>(1e-6 * normal(random), 1e-6 * normal(random));
    return response::PeriodicSystem(response::rotor_equations(drawn), {});
  };
  for (auto _ : state)
    state.counters["lost"] =
        response::curve_band(system, curves, 0, o, response::ResponseCurve::radius, draw, 1000, 300).lost;
}
BENCHMARK(ThousandAnisotropicCurves)->Unit(benchmark::kMillisecond);

void PeaksOverFortyUnbalances(benchmark::State& state) {
  RotorModel m = rotor();
  m.k1_conj = {300, 120};
  const response::PeriodicSystem system(response::rotor_equations(m), {"", 0, 1, true});
  response::CurveOptions o;
  o.from = 40;
  o.to = 200;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        response::peak_over_force(system, Eigen::VectorXd::LinSpaced(40, 0.05, 2), o, response::ResponseCurve::radius)
            .jump_from);
}
BENCHMARK(PeaksOverFortyUnbalances)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
