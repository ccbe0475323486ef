#pragma once
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/testing/machines.hpp"

/// Rotors with one part that real machines have beside shaft, damping and unbalance, drawn with a seed; made apart from
/// the code under test: real coordinates, forces written one by one, Dormand-Prince steps.
namespace whirl::testing {

enum class Part {
  blade_loss,     ///< the unbalance changes by half to twice its size, at any angle, at any instant of the middle half
  loose_bolt,     ///< k falls by 1 to 5 % at such an instant
  two_clocks,     ///< the displacement recorder runs 50 to 200 ppm fast or slow
  loss_factor,    ///< of 0.02 to 0.05: the damper loss k / w at the rotor speed w, beside viscous damping
  keyway,         ///< stiffness higher by 1 to 3 % along an axis that turns with the shaft, which sags
  rubber,         ///< force as the square of the deflection, 10 to 20 % of the linear one at 1 mm
  swirl_damping,  ///< force along i v, 30 to 60 % of the damping
  rolling_bearing,  ///< force as deflection to the power 3/2, 10 to 20 % of the linear one at 1 mm
  preload,          ///< stiffer to one side, at any angle: 1 to 4 % of the linear force at 1 mm
  film              ///< damping that grows as (1 - (r / gap)^2)^(-3/2), gap 1.6 to 2.5 times the peak
};
struct PartName {
  Part part;
  const char* name;   ///< for tables
  const char* label;  ///< of the term
};
inline constexpr std::array kParts{
    PartName{Part::blade_loss, "blade lost", "unbalance changing at one instant"},
    PartName{Part::loose_bolt, "stiffness falls at once", "stiffness changing at one instant"},
    PartName{Part::two_clocks, "two clocks", "clocks that drift apart"},
    PartName{Part::loss_factor, "loss factor", "structural damping"},
    PartName{Part::keyway, "keyway", "stiffness turning with the shaft"},
    PartName{Part::rubber, "rubber mount", "stiffness growing with deflection"},
    PartName{Part::swirl_damping, "swirl damping", "cross-coupled damping"},
    PartName{Part::rolling_bearing, "rolling bearing", "Hertz contact"},
    PartName{Part::preload, "preload to one side", "springs stiffer to one side"},
    PartName{Part::film, "squeeze film", "damping growing with the orbit"}};

/// A record, what is true of its rotor (after a change: of the changed one), and the size of the part.
struct PartRecord {
  Recording record;
  double k1, k2, c, e;
  double size;         ///< as the term of the model counts it; NaN: it counts it otherwise
  double instant = 0;  ///< s, of a change
};

inline PartRecord part_record(Part part, double snr, unsigned long long seed) {
  using machines_detail::State;
  DrawnMachine drawn = draw_machine(Oddity::none, seed + 9000);
  Machine& m = drawn.machine;
  const Run& run = drawn.run;
  std::mt19937_64 random(seed * 0x9E3779B97F4A7C15ULL + 3);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const double sign = uniform(-1, 1) < 0 ? -1 : 1, turn = uniform(-3, 3), share = uniform(0, 1);
  const double instant = run.seconds * uniform(0.25, 0.75);
  PartRecord out{{}, m.k, m.cubic, m.c, m.e, NAN, instant};
  double clock = 1, loss = 0, spring2 = 0, spring15 = 0, swirl = 0, gap = 0, lost = 0, fall = 0, key = 0, sag = 0;
  switch (part) {
    case Part::blade_loss:
      lost = m.e * (0.5 + 1.5 * share), out.size = lost;
      out.e = std::abs(std::polar(m.e, m.e_phase) + std::polar(lost, turn));
      break;
    case Part::loose_bolt:
      fall = m.k * (0.01 + 0.04 * share), out.size = -fall, out.k1 = m.k - fall;
      break;
    case Part::two_clocks:
      clock = 1 + sign * (50 + 150 * share) * 1e-6, out.size = 1 - clock;
      break;
    case Part::loss_factor:
      loss = m.k * (0.02 + 0.03 * share), out.size = loss;
      break;
    case Part::keyway:
      key = m.k * (0.01 + 0.02 * share), out.size = key, sag = 1e-4;
      break;
    case Part::rubber:
      spring2 = m.k * (0.1 + 0.1 * share) / 1e-3, out.size = spring2;
      break;
    case Part::swirl_damping:
      swirl = m.c * (0.3 + 0.3 * share), out.size = swirl;
      break;
    case Part::rolling_bearing:
      spring15 = m.k * (0.1 + 0.1 * share) / std::sqrt(1e-3), out.size = spring15;
      break;
    case Part::preload: {
      const double lean = m.k * (0.01 + 0.03 * share) / 1e-3;
      m.lean_x = lean * std::cos(turn), m.lean_y = lean * std::sin(turn);
      break;
    }
    case Part::film:
      gap = (1.6 + 0.9 * share) * readings(m, run).rowwise().norm().maxCoeff();
      break;
  }
  const auto f = [&](double t, const State& s) {
    const bool before = t < 0;  // constant speed
    const double now = std::max(t, 0.0), w = run.omega(now), a = before ? 0.0 : run.alpha();
    const double beta = before ? run.beta0 + w * t : run.beta(t);
    State d = machines_detail::slope(m, now, beta, w, a, s);
    const double r = std::hypot(s[0], s[2]);
    double along = -spring2 * r - spring15 * std::sqrt(r);              // along the deflection
    double drag = -loss / std::max(std::abs(w), 2 * std::numbers::pi);  // along the velocity
    if (gap > 0) drag -= m.c * (std::pow(1 - std::pow(std::min(r / gap, 0.95), 2), -1.5) - 1);
    if (t > instant) along += fall;
    d[1] += along * s[0] + drag * s[1] - swirl * s[3];
    d[3] += along * s[2] + drag * s[3] + swirl * s[1] - sag * m.k;
    if (key > 0) {  // k + key along the turning axis, k - key across it
      const double co = std::cos(beta + turn), si = std::sin(beta + turn);
      const double on = co * s[0] + si * s[2], off = co * s[2] - si * s[0];
      d[1] -= key * (co * on + si * off);
      d[3] -= key * (si * on - co * off);
    }
    if (t > instant && lost > 0) {
      const double at = beta + turn;
      d[1] += lost * (w * w * std::cos(at) + a * std::sin(at));
      d[3] += lost * (w * w * std::sin(at) - a * std::cos(at));
    }
    return d;
  };
  const double lead = 2, h = 2.5e-4, w0 = run.omega(0);
  State s{};
  const std::complex<double> z = w0 * w0 * std::polar(m.e, m.e_phase) / std::complex<double>(m.k - w0 * w0, m.c * w0) *
                                 std::polar(1.0, run.beta0 - w0 * lead);
  s[0] = z.real(), s[1] = -w0 * z.imag(), s[2] = z.imag() - sag, s[3] = w0 * z.real();
  double t = -lead;
  const auto advance = [&](double to) {
    const int steps = std::max(1, static_cast<int>(std::ceil((to - t) / h - 1e-9)));
    const double d = (to - t) / steps;
    for (int i = 0; d > 0 && i < steps; ++i) s = machines_detail::step(f, t + i * d, s, d);
    t = to;
  };
  Eigen::MatrixX2d read(run.samples(), 2);
  for (Eigen::Index i = 0; i < read.rows(); ++i) {
    advance(run.dt * static_cast<double>(i) * clock);
    read(i, 0) = s[0] + m.offset_x;
    read(i, 1) = s[2] + m.offset_y;
  }
  add_noise(read, snr, seed * 15485863 + 1);
  out.record = machine_record(read, run);
  return out;
}

}  // namespace whirl::testing
