// Promise: 15 s of run-down at 1 kHz in under 5 ms.
#include <benchmark/benchmark.h>

#include "whirl/rotor/simulate.hpp"

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
const rotor::SpeedProfile kProfile = rotor::SpeedProfile::run_down(2 * 3.14159265358979 * 40, 15);

void Simulate(benchmark::State& state) {
  const AngleSignal angle = rotor::angle_signal(kProfile, 1e-3);
  for (auto _ : state) benchmark::DoNotOptimize(rotor::simulate(rotor(), angle).z[14999]);
}
BENCHMARK(Simulate)->Unit(benchmark::kMillisecond);

void SimulateWithTabulatedForcing(benchmark::State& state) {
  const AngleSignal angle = rotor::angle_signal(kProfile, 1e-3);
  const Eigen::VectorXcd forcing = rotor::unbalance_forcing(angle);
  const rotor::WhirlState start = rotor::steady_whirl(rotor(), angle.omega[0]);
  for (auto _ : state) benchmark::DoNotOptimize(rotor::simulate_main_mode(rotor(), forcing, 1e-3, start).z[14999]);
}
BENCHMARK(SimulateWithTabulatedForcing)->Unit(benchmark::kMillisecond);

void SimulateWithTwoForcedModes(benchmark::State& state) {
  const AngleSignal angle = rotor::angle_signal(kProfile, 1e-3);
  RotorModel m = rotor();
  m.modes = {{289, 0.008, 1e-5}, {804, 0.006, 1e-5}};
  for (auto _ : state) benchmark::DoNotOptimize(rotor::simulate(m, angle).z[14999]);
}
BENCHMARK(SimulateWithTwoForcedModes)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
