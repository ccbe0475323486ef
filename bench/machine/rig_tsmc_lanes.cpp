// Promise: at least 1000 (AVX-512) or 600 (AVX2) closed-loop runs of 14 s per second and core with the ideal
// rotor and the terminal sliding mode law of paper eq. 43, lanes equal to scalar runs to 1e-9 m. Items are
// rig runs.
#include <benchmark/benchmark.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "whirl/rig/batch.hpp"

namespace {

using namespace whirl;

// exp and log without branches, so that loops over lanes become vector code; the library's own are scalar
// unless the compiler may ignore NaN. Relative error below 1e-15 for |x| < 700, positive normal arguments.
inline double lane_exp(double x) {
  constexpr double kRound = 0x1.8p52;
  const double shifted = x * 1.4426950408889634 + kRound, n = shifted - kRound;
  const double r = (x - n * 0x1.62e42fee00000p-1) - n * 0x1.a39ef35793c76p-33;
  double p = 1.0 / 6227020800;
  p = p * r + 1.0 / 479001600;
  p = p * r + 1.0 / 39916800;
  p = p * r + 1.0 / 3628800;
  p = p * r + 1.0 / 362880;
  p = p * r + 1.0 / 40320;
  p = p * r + 1.0 / 5040;
  p = p * r + 1.0 / 720;
  p = p * r + 1.0 / 120;
  p = p * r + 1.0 / 24;
  p = p * r + 1.0 / 6;
  p = p * r + 0.5;
  p = (p * r + 1) * r + 1;
  return p * std::bit_cast<double>((std::bit_cast<std::uint64_t>(shifted) + 1023) << 52);
}
inline double lane_log(double x) {
  // x = 2^n m with m around 1; log m = 2 atanh(s), s = (m - 1)/(m + 1), |s| < 0.172.
  constexpr std::uint64_t kHalfRoot = 0x3fe6a09e667f3bcd, kMantissa = 0x000fffffffffffff;  // sqrt(1/2)
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x) - kHalfRoot + (std::uint64_t{1023} << 52);
  const double n = std::bit_cast<double>((bits >> 52) | 0x4330000000000000) - (0x1p52 + 1023);
  const double m = std::bit_cast<double>((bits & kMantissa) + kHalfRoot);
  const double s = (m - 1) / (m + 1), q = s * s;
  double p = 1.0 / 19;
  p = p * q + 1.0 / 17;
  p = p * q + 1.0 / 15;
  p = p * q + 1.0 / 13;
  p = p * q + 1.0 / 11;
  p = p * q + 1.0 / 9;
  p = p * q + 1.0 / 7;
  p = p * q + 1.0 / 5;
  p = p * q + 1.0 / 3;
  return n * 0.69314718055994531 + 2 * s * (1 + p * q);
}

// Eq. 43 per axis with filtered difference, lengths in mm inside the terminal term; parameters per lane.
struct Law {
  double surface = 60, rho = 3, layer = 0.1, exponent = 0.75;
};
constexpr double kFloor = 30e-6, kUnit = 1e-3, kFilter = 0.5, kK1 = 8882.6, kDamping = 7.5;

template <class Exp, class Log>
inline double force(const Law& law, double x, double v, double d, Exp&& e, Log&& l) {
  const double size = std::abs(x), clamped = size > kFloor ? size : kFloor;
  const double slope = e((law.exponent - 1) * l(clamped * (1 / kUnit)));  // (|x| / unit)^(r - 1)
  const double s = v + law.surface * slope * x, t = e(-2 * std::abs(s) / law.layer);
  const double tanh = std::copysign((1 - t) / (1 + t), s);
  const double f = -kK1 * x - kDamping * v + d;
  return -(f + law.surface * law.exponent * slope * v + law.rho * tanh);
}

rig::RigParameters ideal() {
  rig::RigParameters p = rig::RigParameters::ideal_rotor_b();
  p.profile = rig::RigParameters::default_profile();
  p.actuator.delay_samples = 1;
  return p;
}

struct Feedforward {
  double x, y;
};
Feedforward unbalance(double beta, double omega, double alpha) {
  const double c = std::cos(beta), s = std::sin(beta);
  return {3e-4 * (omega * omega * c + alpha * s), 3e-4 * (omega * omega * s - alpha * c)};
}

Law law_of(int lane) {
  Law law;
  law.surface = 40 + lane;
  return law;
}

double scalar_peak(rig::VirtualRig& rig, const Law& law) {
  const auto e = [](double v) { return std::exp(v); };
  const auto l = [](double v) { return std::log(v); };
  const rig::RigTruth truth(rig);
  double x = rig.read().x, y = rig.read().y, vx = 0, vy = 0, peak = 0;
  while (!rig.done()) {
    const Measurement m = rig.read();
    vx += kFilter * ((m.x - x) * 1e3 - vx);
    vy += kFilter * ((m.y - y) * 1e3 - vy);
    x = m.x, y = m.y;
    const Feedforward d = unbalance(m.beta, m.omega, m.omega_dot);
    rig.write({force(law, x, vx, d.x, e, l), force(law, y, vy, d.y, e, l)});
    if (rig.tick() > 500) peak = std::max(peak, std::abs(truth.z().real()));
    rig.advance();
  }
  return peak;
}

template <int Lanes>
rig::LaneArray<Lanes> lane_peaks(rig::BatchRig<Lanes>& rig) {
  rig::LaneArray<Lanes> surface, x = rig.read().x, y = rig.read().y, vx, vy, ux, uy, peak;
  for (int i = 0; i < Lanes; ++i) surface[i] = law_of(i).surface;
  while (!rig.done()) {
    const auto& m = rig.read();
    const rig::LaneArray<Lanes> mx = m.x, my = m.y;  // copies: the compiler then knows that nothing overlaps
    const Feedforward d = unbalance(m.beta, m.omega, m.omega_dot);
    for (int i = 0; i < Lanes; ++i) {
      vx[i] += kFilter * ((mx[i] - x[i]) * 1e3 - vx[i]);
      vy[i] += kFilter * ((my[i] - y[i]) * 1e3 - vy[i]);
      Law law;
      law.surface = surface[i];
      ux[i] = force(law, mx[i], vx[i], d.x, lane_exp, lane_log);
      uy[i] = force(law, my[i], vy[i], d.y, lane_exp, lane_log);
    }
    x = mx, y = my;
    if (rig.tick() > 500) {
      const auto& z = rig.true_x();
      for (int i = 0; i < Lanes; ++i) {
        const double size = std::abs(z[i]);
        peak[i] = size > peak[i] ? size : peak[i];
      }
    }
    rig.write(ux, uy);
    rig.advance();
  }
  return peak;
}

void Scalar(benchmark::State& state) {
  rig::VirtualRig rig(ideal());
  for (auto _ : state) {
    rig.restart(1);
    benchmark::DoNotOptimize(scalar_peak(rig, law_of(3)));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(Scalar)->Unit(benchmark::kMillisecond);

template <int Lanes>
void Batched(benchmark::State& state) {
  rig::BatchRig<Lanes> rig(rig::make_rig_tables(ideal()));
  rig::LaneArray<Lanes> peaks;
  for (auto _ : state) {
    rig.restart(1);
    peaks = lane_peaks(rig);
  }
  state.SetItemsProcessed(state.iterations() * Lanes);
  double worst = 0;
  for (int i = 0; i < Lanes; ++i) {
    rig::VirtualRig scalar(ideal());
    worst = std::max(worst, std::abs(scalar_peak(scalar, law_of(i)) - peaks[i]));
  }
  state.counters["difference_m"] = worst;
  state.counters["peak_m"] = peaks[3];
  if (!(worst < 1e-9)) state.SkipWithError("lanes differ from scalar runs");
}
BENCHMARK(Batched<8>)->Unit(benchmark::kMillisecond);
BENCHMARK(Batched<16>)->Unit(benchmark::kMillisecond);
BENCHMARK(Batched<32>)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
