#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "whirl/testing/machines.hpp"

/// Rotor records of kinds that no list of terms holds: forces of other machine parts, excitations beside the unbalance,
/// runs and sensors that are not what they are taken for. The plain rotor is that of draw_machine, integrated by the
/// same Dormand-Prince steps; nothing here knows RotorModel.
namespace whirl::testing {

enum class OddKind {
  clearance,     ///< a third of the stiffness acts beyond a gap of 0.1 mm only
  stop,          ///< rub on a stop: 0.4 k more beyond 60 % of the largest deflection
  magnetic,      ///< negative stiffness of 5 % that grows towards a gap of 8 mm
  maxwell,       ///< a spring and damper in series beside the shaft, 10 % of k, corner at 5 Hz
  foundation,    ///< the bearings stand on a mass with a mode at 1.8 times the critical speed
  crack,         ///< breathing: k lower by up to 3 % where the crack opens
  misalignment,  ///< force of twice the speed
  blades,        ///< force of seven times the speed
  drive_ripple,  ///< the shaft swings by 5 mrad about the angle that is recorded, four times a turn
  belt,          ///< force of 0.43 times the speed
  mass_lost,     ///< a third of the unbalance is lost in the middle of the run
  moving_fluid,  ///< the unbalance turns by 30 degrees over the run
  floor,         ///< the floor shakes, broadband
  base_impact,   ///< one blow at the base near the critical speed
  growing_bow,   ///< a bow that grows to 50 um over the run
  speed_steps,   ///< speed in steps instead of a sweep
  low_pass,      ///< sensors with a low-pass of second order, 120 Hz
  cubic_probe,   ///< sensor gain falls by 3 % at 3 mm
  late_axis,     ///< y is read 0.5 ms after x
  ac_coupled,    ///< high-pass of first order, 0.7 Hz, on both probes
  integrated,    ///< pickups of velocity with integrators: high-pass of second order (Butterworth), 1.5 Hz
  eight_bits,    ///< readings in 256 counts of 8 mm
  wrong_rate,    ///< sample rate stated 0.5 % too high
  lost_pulses,   ///< angle from pulses of which one in fifty is missed
  sag,           ///< horizontal shaft that sags by 0.4 mm
  upper_mode,    ///< a second bending mode at 1.4 to 3 times the top speed, with an unbalance of its own
};
inline constexpr std::array kOddKinds = {std::pair{OddKind::clearance, "clearance"},
                                         std::pair{OddKind::stop, "rub on a stop"},
                                         std::pair{OddKind::magnetic, "magnetic pull"},
                                         std::pair{OddKind::maxwell, "viscoelastic support"},
                                         std::pair{OddKind::foundation, "foundation"},
                                         std::pair{OddKind::crack, "breathing crack"},
                                         std::pair{OddKind::misalignment, "misalignment"},
                                         std::pair{OddKind::blades, "blades"},
                                         std::pair{OddKind::drive_ripple, "drive ripple"},
                                         std::pair{OddKind::belt, "belt"},
                                         std::pair{OddKind::mass_lost, "mass lost"},
                                         std::pair{OddKind::moving_fluid, "moving fluid"},
                                         std::pair{OddKind::floor, "shaking floor"},
                                         std::pair{OddKind::base_impact, "impact at the base"},
                                         std::pair{OddKind::growing_bow, "growing bow"},
                                         std::pair{OddKind::speed_steps, "speed in steps"},
                                         std::pair{OddKind::low_pass, "slow sensors"},
                                         std::pair{OddKind::cubic_probe, "bent probe curve"},
                                         std::pair{OddKind::late_axis, "y read late"},
                                         std::pair{OddKind::ac_coupled, "AC-coupled probes"},
                                         std::pair{OddKind::integrated, "integrated pickups"},
                                         std::pair{OddKind::eight_bits, "8 bits"},
                                         std::pair{OddKind::wrong_rate, "wrong rate"},
                                         std::pair{OddKind::lost_pulses, "lost pulses"},
                                         std::pair{OddKind::sag, "sag"},
                                         std::pair{OddKind::upper_mode, "mode above the speeds"}};

/// A record with what is true of its rotor; NaN: not defined for this kind.
struct OddRecord {
  Recording record;
  double k1, k2, c, e;
  bool pulses = false;  ///< the angle stands in channel "pulse" only
};

namespace odd_detail {

constexpr double kSag = 4e-4;  // m, by the weight, of the linear spring alone

/// The second bending mode of the kind upper_mode: its frequency, and its unbalance as the probes weigh it.
struct UpperMode {
  double w, zeta, e, phase;
};
inline UpperMode draw_upper_mode(const Machine& m, unsigned long long seed) {
  std::mt19937_64 random(seed * 2654435761ULL + 7);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  return {uniform(1.4, 3) * m.top_speed, uniform(0.005, 0.03), uniform(0.3, 1) * m.e, uniform(-3, 3)};
}

struct Turn {
  double beta, w, a;  ///< rad, rad/s, rad/s^2
};

/// Forces of the kind in a state x, x', y, y' and four of the parts around.
inline machines_detail::State slope(OddKind kind, const Machine& m, const UpperMode& upper, const Run& run, double t,
                                    const Turn& turn, double ground_x, double ground_y,
                                    const machines_detail::State& s) {
  machines_detail::State d{};
  double k = m.k, e = m.e, heavy = m.e_phase;
  double x = s[0], y = s[2];
  const double share = std::clamp(t / run.seconds, 0.0, 1.0);
  double fx = 0, fy = 0;
  const auto radial = [&](double force, double r) {
    if (r <= 0) return;
    fx -= force * s[0] / r;
    fy -= force * s[2] / r;
  };
  const double r = std::hypot(s[0], s[2]);
  switch (kind) {
    case OddKind::clearance:
      k *= 2.0 / 3;
      radial(m.k / 3 * std::max(0.0, r - 1e-4), r);
      break;
    case OddKind::stop:
      radial(0.4 * m.k * std::max(0.0, r - m.bow), r);  // bow: where the stop stands
      break;
    case OddKind::magnetic:
      radial(-0.05 * m.k * r / (1 - std::pow(std::min(r, 7e-3) / 8e-3, 2)), r);
      break;
    case OddKind::maxwell: {
      const double rate = 2 * std::numbers::pi * 5;
      fx -= 0.1 * m.k * (s[0] - s[4]);
      fy -= 0.1 * m.k * (s[2] - s[6]);
      d[4] = rate * (s[0] - s[4]);
      d[6] = rate * (s[2] - s[6]);
      break;
    }
    case OddKind::foundation: {
      x -= s[4], y -= s[6];
      const double heavy_base = 4, kb = heavy_base * std::pow(1.8, 2) * m.k, cb = heavy_base * 0.04 * std::sqrt(m.k);
      const double spring = m.k + m.cubic * (x * x + y * y);
      d[4] = s[5];
      d[5] = (-kb * s[4] - cb * s[5] + spring * x + m.c * (s[1] - s[5])) / heavy_base;
      d[6] = s[7];
      d[7] = (-kb * s[6] - cb * s[7] + spring * y + m.c * (s[3] - s[7])) / heavy_base;
      fx += m.c * s[5];
      fy += m.c * s[7];
      break;
    }
    case OddKind::crack: {
      const double across = std::cos(turn.beta) * x + std::sin(turn.beta) * y;  // along the crack's normal
      const double open = 0.5 * (1 + std::tanh(across / 1e-4));
      fx += 0.03 * m.k * open * across * std::cos(turn.beta);
      fy += 0.03 * m.k * open * across * std::sin(turn.beta);
      break;
    }
    case OddKind::misalignment:
      fx += 0.3 * e * turn.w * turn.w * std::cos(2 * turn.beta);
      fy += 0.3 * e * turn.w * turn.w * std::sin(2 * turn.beta);
      break;
    case OddKind::blades:
      fx += 0.5 * e * m.k * std::cos(7 * turn.beta);
      fy += 0.5 * e * m.k * std::sin(7 * turn.beta);
      break;
    case OddKind::belt:
      fx += 0.2 * e * m.k * std::cos(0.43 * turn.beta + 1);
      break;
    case OddKind::mass_lost:
      if (share > 0.5) e *= 2.0 / 3;
      break;
    case OddKind::moving_fluid:
      heavy += share * std::numbers::pi / 6;
      break;
    case OddKind::growing_bow:
      fx += m.k * 5e-5 * share * std::cos(turn.beta + 1);
      fy += m.k * 5e-5 * share * std::sin(turn.beta + 1);
      break;
    case OddKind::sag:
      fy -= m.k * kSag;
      break;
    case OddKind::upper_mode: {
      const double at = upper.phase + turn.beta, square = turn.w * turn.w;
      d[4] = s[5];
      d[5] = upper.e * (square * std::cos(at) + turn.a * std::sin(at)) -
             upper.w * (upper.w * s[4] + 2 * upper.zeta * s[5]);
      d[6] = s[7];
      d[7] = upper.e * (square * std::sin(at) - turn.a * std::cos(at)) -
             upper.w * (upper.w * s[6] + 2 * upper.zeta * s[7]);
      break;
    }
    default:
      break;
  }
  const double spring = k + m.cubic * (x * x + y * y), a = turn.a, w2 = turn.w * turn.w;
  const double angle = heavy + turn.beta;
  d[0] = s[1];
  d[1] = fx - spring * x - m.c * s[1] + e * (w2 * std::cos(angle) + a * std::sin(angle)) + ground_x;
  d[2] = s[3];
  d[3] = fy - spring * y - m.c * s[3] + e * (w2 * std::sin(angle) - a * std::cos(angle)) + ground_y;
  return d;
}

/// Angle of the run: a sweep, or 24 steps of speed that each last half a second, 50 ms of it a change.
inline Turn turn_at(OddKind kind, const Run& run, double t) {
  if (kind != OddKind::speed_steps || t <= 0)
    return {run.beta(t), run.omega(std::max(t, 0.0)), t > 0 ? run.alpha() : 0};
  const double each = 0.5, change = 0.05, per = run.alpha() * each;
  const double n = std::floor(t / each), left = t - n * each;
  const double rest = std::max(0.0, left - (each - change));
  const double w0 = run.omega(0) + n * per, a = left > each - change ? per / change : 0;
  const double done = run.beta0 + run.omega(0) * n * each + per * each * n * (n - 1) / 2 + per * change / 2 * n;
  return {done + w0 * left + 0.5 * a * rest * rest, w0 + a * rest, a};
}

}  // namespace odd_detail

/// A drawn rotor of the kind at `snr` dB.
inline OddRecord odd_record(OddKind kind, double snr, unsigned long long seed) {
  using machines_detail::State;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const DrawnMachine drawn = draw_machine(Oddity::none, seed + 500);
  Machine m = drawn.machine;
  const Run& run = drawn.run;
  const odd_detail::UpperMode upper = odd_detail::draw_upper_mode(m, seed);
  std::mt19937_64 random(seed * 6364136223846793005ULL + 99);
  std::normal_distribution<double> normal;
  m.bow = 0.6 * readings(m, run).rowwise().norm().maxCoeff();  // the stop
  const double h = 2.5e-4, lead = 2;
  const auto substeps = static_cast<Eigen::Index>(std::lround(run.dt / h));
  const Eigen::Index n = run.samples();
  double ground_x = 0, ground_y = 0;
  const auto f = [&](double t, const State& s) {
    odd_detail::Turn turn =
        t < 0 ? odd_detail::Turn{run.beta0 + run.omega(0) * t, run.omega(0), 0} : odd_detail::turn_at(kind, run, t);
    if (kind == OddKind::drive_ripple) {
      const double swing = 5e-3, arg = 4 * turn.beta, rate = 4 * turn.w;
      turn.a += -swing * rate * rate * std::sin(arg);
      turn.w += swing * rate * std::cos(arg);
      turn.beta += swing * std::sin(arg);
    }
    return odd_detail::slope(kind, m, upper, run, t, turn, ground_x, ground_y, s);
  };
  State s{};
  const double w = run.omega(0);
  const std::complex<double> start = w * w * std::polar(m.e, m.e_phase) / std::complex<double>(m.k - w * w, m.c * w) *
                                     std::polar(1.0, run.beta0 - w * lead);
  s[0] = start.real(), s[1] = -w * start.imag(), s[2] = start.imag(), s[3] = w * start.real();
  Eigen::MatrixX2d z(n, 2);
  Eigen::VectorXd beta(n);
  std::array<State, 2> slow{};  // low-pass: value and rate of each axis
  std::vector<double> past_y;
  const double shake = 0.01 * m.e * m.k;
  const double critical = (std::sqrt(m.k) - run.omega(0)) / run.alpha();
  const auto before = static_cast<Eigen::Index>(std::lround(lead / run.dt));
  for (Eigen::Index i = -before; i < n; ++i) {
    const double t = run.dt * static_cast<double>(i);
    if (i >= 0) {
      z(i, 0) = s[0], z(i, 1) = s[2];
      if (kind == OddKind::upper_mode) z(i, 0) += s[4], z(i, 1) += s[6];
      beta[i] = odd_detail::turn_at(kind, run, t).beta;
    }
    for (Eigen::Index j = 0; j < substeps; ++j) {
      const double now = t + h * static_cast<double>(j);
      if (kind == OddKind::floor) {
        // Of the first order, corner at 50 Hz.
        const double keep = std::exp(-h * 2 * std::numbers::pi * 50), push = std::sqrt(1 - keep * keep);
        ground_x = keep * ground_x + push * 20 * shake * normal(random);
        ground_y = keep * ground_y + push * 20 * shake * normal(random);
      }
      if (kind == OddKind::base_impact) ground_x = std::abs(now - critical - 0.5) < 2e-3 ? 30 * m.e * m.k : 0;
      const State old = s;
      s = machines_detail::step(f, now, s, h);
      if (kind == OddKind::low_pass && i >= 0) {
        const double corner = 2 * std::numbers::pi * 120;
        for (std::size_t axis : {0u, 1u}) {
          const auto g = [&](double, const State& q) {
            State d{};
            d[0] = q[1];
            d[1] = corner * corner * (0.5 * (old[2 * axis] + s[2 * axis]) - q[0]) - 1.4 * corner * q[1];
            return d;
          };
          if (i == 0 && j == 0) slow[axis][0] = old[2 * axis], slow[axis][1] = old[2 * axis + 1];
          slow[axis] = machines_detail::step(g, now, slow[axis], h);
        }
        if (j + 1 == substeps && i + 1 < n) past_y.push_back(slow[1][0]), past_y.push_back(slow[0][0]);
      }
      if (kind == OddKind::integrated) {
        const double corner = 2 * std::numbers::pi * 1.5;
        for (std::size_t axis : {0u, 1u}) {
          const auto g = [&](double u, const State& q) {
            const double share = (u - now) / h;
            State d{};
            d[0] = q[1];
            d[1] = (1 - share) * old[2 * axis] + share * s[2 * axis] - std::numbers::sqrt2 * corner * q[1] -
                   corner * corner * q[0];
            return d;
          };
          slow[axis] = machines_detail::step(g, now, slow[axis], h);
          if (j + 1 == substeps && i + 1 >= 0 && i + 1 < n)
            past_y.push_back(s[2 * axis] - std::numbers::sqrt2 * corner * slow[axis][1] -
                             corner * corner * slow[axis][0]);
        }
      }
      if (kind == OddKind::late_axis && j == substeps / 2 && i >= 0) past_y.push_back(old[2]);
    }
  }
  OddRecord odd{{}, m.k, m.cubic, m.c, m.e};
  if (kind == OddKind::low_pass) {
    for (Eigen::Index i = 1; i < n; ++i)
      z(i, 0) = past_y[static_cast<std::size_t>(2 * i - 1)], z(i, 1) = past_y[static_cast<std::size_t>(2 * i - 2)];
  }
  if (kind == OddKind::late_axis) {  // the half step before
    for (Eigen::Index i = 1; i < n; ++i) z(i, 1) = past_y[static_cast<std::size_t>(i - 1)];
  }
  if (kind == OddKind::integrated) {
    for (Eigen::Index i = 0; i < n; ++i)
      z(i, 0) = past_y[static_cast<std::size_t>(2 * i)], z(i, 1) = past_y[static_cast<std::size_t>(2 * i + 1)];
  }
  if (kind == OddKind::ac_coupled) {  // the capacitor holds the mean over the past
    const double keep = std::exp(-2 * std::numbers::pi * 0.7 * run.dt);
    Eigen::RowVector2d last = z.row(0), charge = last;
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::RowVector2d now = z.row(i), middle = 0.5 * (now + last);
      charge = middle + keep * (charge - middle);
      z.row(i) = now - charge;
      last = now;
    }
  }
  if (kind == OddKind::cubic_probe) z = z.unaryExpr([](double v) { return v * (1 - 0.03 * v * v / 9e-6); });
  add_noise(z, snr, seed * 104729 + 11);
  if (kind == OddKind::eight_bits)
    z = z.unaryExpr([](double v) { return std::round(v / (8e-3 / 256)) * (8e-3 / 256); });
  odd.record = machine_record(z, run);
  odd.record.channels.back().samples = beta;
  if (kind == OddKind::lost_pulses) {
    odd.pulses = true;
    Eigen::VectorXd pulse = Eigen::VectorXd::Zero(n);
    std::uniform_real_distribution<double> chance;
    for (Eigen::Index i = 1; i < n; ++i) {
      const double turns =
          std::floor(beta[i] / (2 * std::numbers::pi)) - std::floor(beta[i - 1] / (2 * std::numbers::pi));
      if (turns > 0 && chance(random) > 0.02) pulse.segment(i, std::min<Eigen::Index>(4, n - i)).setConstant(5);
    }
    odd.record.channels.back() = {"pulse", Quantity::voltage, pulse};
  }
  if (kind == OddKind::wrong_rate) {
    const double faster = 1.005;
    odd.record.dt /= faster;
    odd.k1 *= faster * faster, odd.k2 *= faster * faster, odd.c *= faster;
  }
  switch (kind) {
    case OddKind::clearance:
    case OddKind::stop:
      odd.k1 = kind == OddKind::stop ? m.k : kNone, odd.k2 = kNone;
      break;
    case OddKind::sag: {  // about the position at rest, the mean of both axes
      double sag = odd_detail::kSag;
      for (int i = 0; i < 20; ++i)
        sag -= (m.k * (sag - odd_detail::kSag) + m.cubic * sag * sag * sag) / (m.k + 3 * m.cubic * sag * sag);
      odd.k1 = m.k + 2 * m.cubic * sag * sag;
      break;
    }
    case OddKind::magnetic:
      odd.k1 = 0.95 * m.k, odd.k2 = m.cubic - 0.05 * m.k / 64e-6;
      break;
    case OddKind::maxwell:
    case OddKind::foundation:
      odd.k1 = odd.k2 = odd.c = kNone;
      if (kind == OddKind::foundation) odd.e = kNone;
      break;
    case OddKind::crack:
      odd.k1 = kNone;
      break;
    case OddKind::mass_lost:
    case OddKind::moving_fluid:
      odd.e = kNone;
      break;
    default:
      break;
  }
  return odd;
}

}  // namespace whirl::testing
