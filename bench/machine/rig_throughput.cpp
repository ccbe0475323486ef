// Promises: at least 250 closed-loop runs of 14 s per second and core with everything modelled (sensors,
// converters, modes, actuators, noise); at least 1000 (AVX-512) or 600 (AVX2) with the ideal rotor in lanes.
// Items are rig runs.
#include <benchmark/benchmark.h>

#include <cmath>

#include "whirl/rig/batch.hpp"

namespace {

using namespace whirl;

rig::RigParameters ideal() {
  rig::RigParameters p = rig::RigParameters::ideal_rotor_b();
  p.profile = rig::RigParameters::default_profile();
  return p;
}
rig::RigParameters full(int substeps) {
  rig::RigParameters p;
  p.timing.substeps = substeps;
  return p;
}

// Filtered difference and velocity feedback: the cheapest law, so that the plant is measured.
void scalar_run(benchmark::State& state, const rig::RigParameters& parameters) {
  const auto tables = rig::make_rig_tables(parameters);
  rig::VirtualRig rig(tables, {});
  std::uint64_t seed = 0;
  for (auto _ : state) {
    rig.restart(++seed);
    double x = 0, y = 0, vx = 0, vy = 0;
    while (!rig.done()) {
      const Measurement m = rig.read();
      vx += 0.5 * ((m.x - x) * 1e3 - vx);
      vy += 0.5 * ((m.y - y) * 1e3 - vy);
      x = m.x, y = m.y;
      rig.write({-60 * vx, -60 * vy});
      rig.advance();
    }
    benchmark::DoNotOptimize(rig::RigTruth(rig).z());
  }
  state.SetItemsProcessed(state.iterations());
}

template <int Lanes>
void batch_run(benchmark::State& state, const rig::RigParameters& parameters) {
  rig::BatchRig<Lanes> rig(rig::make_rig_tables(parameters));
  std::uint64_t seed = 0;
  rig::LaneArray<Lanes> gain;
  for (int i = 0; i < Lanes; ++i) gain[i] = 10 + 4 * i;
  for (auto _ : state) {
    rig.restart(++seed);
    rig::LaneArray<Lanes> x, y, vx, vy, ux, uy;
    while (!rig.done()) {
      const auto& m = rig.read();
      for (int i = 0; i < Lanes; ++i) {
        vx[i] += 0.5 * ((m.x[i] - x[i]) * 1e3 - vx[i]);
        vy[i] += 0.5 * ((m.y[i] - y[i]) * 1e3 - vy[i]);
        ux[i] = -gain[i] * vx[i];
        uy[i] = -gain[i] * vy[i];
      }
      x = m.x, y = m.y;
      rig.write(ux, uy);
      rig.advance();
    }
    benchmark::DoNotOptimize(rig.true_x());
  }
  state.SetItemsProcessed(state.iterations() * Lanes);
}

#define RIG_RUN(name, ...)                        \
  void name(benchmark::State& s) { __VA_ARGS__; } \
  BENCHMARK(name)->Unit(benchmark::kMillisecond)
RIG_RUN(FullRig4Substeps, scalar_run(s, full(4)));
RIG_RUN(FullRig8Substeps, scalar_run(s, full(8)));
RIG_RUN(FullRig8Lanes, batch_run<8>(s, full(4)));
RIG_RUN(FullRig32Lanes, batch_run<32>(s, full(4)));
RIG_RUN(IdealRotor, scalar_run(s, ideal()));
RIG_RUN(IdealRotor8Lanes, batch_run<8>(s, ideal()));
RIG_RUN(IdealRotor16Lanes, batch_run<16>(s, ideal()));
RIG_RUN(IdealRotor32Lanes, batch_run<32>(s, ideal()));

}  // namespace

BENCHMARK_MAIN();
