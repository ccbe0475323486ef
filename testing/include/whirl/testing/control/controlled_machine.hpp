#pragma once
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/testing/machines.hpp"

/// A Machine (testing/machines.hpp: own coordinates, Dormand-Prince) that a controller holds: perfect sensors, forces
/// held from tick to tick, one tick late. Nothing here knows RigParameters.
namespace whirl::testing {

struct ControlledRun {
  double peak_x = 0;          ///< largest |x| after the first half second, m
  std::vector<double> radii;  ///< |x + i y| at every tick, m
  /// Mean rate of the radius between two times, 1/s.
  double growth(double from, double to, double dt = 1e-3) const {
    const auto largest = [&](double t) {
      const auto first = static_cast<std::size_t>(t / dt), count = static_cast<std::size_t>(0.2 / dt);
      return *std::max_element(radii.begin() + static_cast<std::ptrdiff_t>(first),
                               radii.begin() + static_cast<std::ptrdiff_t>(std::min(first + count, radii.size())));
    };
    return std::log(largest(to - 0.2) / largest(from)) / (to - 0.2 - from);
  }
};

/// `step`: Measurement to Command (N), nothing where it has none. Starts on the whirl of the linear rotor, or at rest
/// pushed by `push`, m/s, where that is not 0. `kg`: mass of the disc. A motion beyond 0.1 m ends the run.
template <class Step>
ControlledRun controlled(Machine m, const Run& run, double kg, double gain, Step&& step, double push = 0) {
  using machines_detail::State;
  State s{};
  const double w = run.omega(0);
  const std::complex<double> z =
      std::polar(m.e, m.e_phase + run.beta0) * w * w / std::complex<double>(m.k - w * w, m.c * w);
  if (push != 0) {
    s[1] = push;
  } else {
    s = {z.real(), -w * z.imag(), z.imag(), w * z.real()};
  }
  constexpr int kFine = 8;
  const double h = run.dt / kFine;
  Command waiting;
  ControlledRun out;
  for (long k = 0; k < run.samples(); ++k) {
    const double t = run.dt * static_cast<double>(k), radius = std::hypot(s[0], s[2]);
    out.radii.push_back(radius);
    if (t >= 0.5) out.peak_x = std::max(out.peak_x, std::abs(s[0]));
    if (!(radius < 0.1)) {
      out.peak_x = std::numeric_limits<double>::infinity();
      return out;
    }
    const auto command = step(Measurement{t, s[0], s[2], run.beta(t), run.omega(t), run.alpha(), true});
    m.load_x = gain * waiting.ux / kg, m.load_y = gain * waiting.uy / kg;
    waiting = command ? Command{command->ux, command->uy} : Command{};
    for (int i = 0; i < kFine; ++i) {
      s = machines_detail::step(
          [&](double at, const State& state) {
            return machines_detail::slope(m, at, run.beta(at), run.omega(at), run.alpha(), state);
          },
          t + i * h, s, h);
    }
  }
  return out;
}

}  // namespace whirl::testing
