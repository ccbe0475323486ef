#pragma once
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

/// Records of a rotor's vibration with faults that are known: steady, run-up or run-down, white and 1/f noise, an
/// encoder or one pulse a turn. Sums of sines with their own phases; nothing here knows how they are found.
namespace whirl::testing {

/// Amplitudes are zero to peak, over that of 1X at its largest; 0: not there.
struct VibrationTruth {
  bool runs = false, down = false, encoder = true;
  double second = 0;           ///< 2X
  double half = 0;             ///< 0.5X
  double loose = 0;            ///< largest of 3X to 6X
  double line = 0, twice = 0;  ///< electric
  double sideband = 0;         ///< of 1X, steady records only
  double whirl = 0;            ///< between 0.40X and 0.48X
  double wander = 0;           ///< rad rms of the phase of 1X, steady records only
  double run_out = 0;          ///< runs from low speed only
  double mains = 50;           ///< Hz
  double turning = 0;          ///< Hz, of steady records, else the highest
  double duration = 0, rate = 0;
  double amplitude = 0;        ///< m, of 1X at its largest
  double white = 0, pink = 0;  ///< rms of the noise over that amplitude
  double modulation = 0;       ///< Hz, of the sidebands
  double whirl_order = 0;
};
struct VibrationRecord {
  VibrationTruth truth;
  Recording recording;
};

namespace vibration_detail {

inline constexpr double kTurn = 2 * std::numbers::pi;

struct Draw {
  std::mt19937_64 random;
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); }
  double spread(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }  // even in the logarithm
  bool chance(double p) { return uniform(0, 1) < p; }
  double normal() { return std::normal_distribution<double>()(random); }
};

/// 1/f noise of unit rms: first-order lags an octave apart, of equal power.
inline Eigen::VectorXd pink_noise(Draw& draw, Eigen::Index n) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(n);
  constexpr int kLags = 14;
  for (int k = 0; k < kLags; ++k) {
    const double keep = std::exp(-kTurn * 0.45 / std::pow(2.0, k)), add = std::sqrt(1 - keep * keep);
    double state = draw.normal();
    for (Eigen::Index i = 0; i < n; ++i) {
      out[i] += state;
      state = keep * state + add * draw.normal();
    }
  }
  return out / std::sqrt(static_cast<double>(kLags));
}

/// Slow Gaussian wander of unit rms with a correlation time, s.
inline Eigen::VectorXd slow_wander(Draw& draw, Eigen::Index n, double dt, double time) {
  Eigen::VectorXd out(n);
  const double keep = std::exp(-dt / time), add = std::sqrt(1 - keep * keep);
  double state = draw.normal(), smooth = state;
  for (Eigen::Index i = 0; i < n; ++i) {
    out[i] = smooth;
    state = keep * state + add * draw.normal();
    smooth += (state - smooth) * std::min(1.0, 20 * dt / time);
  }
  return out;
}

/// Distance of a frequency to the nearest multiple of half the turning frequency.
inline double to_half_order(double frequency, double turning) {
  return std::abs(std::remainder(frequency, 0.5 * turning));
}

inline VibrationTruth draw_truth(Draw& d) {
  VibrationTruth t;
  t.runs = d.chance(0.5);
  t.down = d.chance(0.5);
  t.encoder = d.chance(0.5);
  t.mains = d.chance(0.5) ? 50 : 60;
  t.rate = d.chance(0.5) ? 2560 : 5120;
  t.amplitude = d.spread(2e-6, 200e-6);
  const int colour = static_cast<int>(d.uniform(0, 3));
  if (colour != 1) t.white = d.spread(0.02, 0.2);
  if (colour != 0) t.pink = d.spread(0.02, 0.2);
  const auto size = [&](double low, double high) { return d.chance(0.4) ? d.spread(low, high) : 0; };
  t.second = size(0.08, 1.6);
  t.half = size(0.08, 0.5);
  t.loose = size(0.08, 0.4);
  t.line = size(0.08, 0.8);
  t.twice = size(0.08, 1.2);
  t.duration = t.runs ? d.uniform(20, 60) : d.uniform(8, 40);
  if (t.runs) {
    t.turning = d.uniform(35, 90);
    t.run_out = size(0.12, 0.5);
  } else {
    const double apart = 3 / t.duration;
    t.wander = size(8 * kTurn / 360, 25 * kTurn / 360);
    do {
      t.turning = d.chance(0.4) ? t.mains - d.uniform(0.3, 1.2) : d.uniform(12, 110);
    } while (to_half_order(t.mains, t.turning) < apart || to_half_order(2 * t.mains, t.turning) < apart ||
             (t.wander > 0 && to_half_order(t.mains, t.turning) < 2));
    t.sideband = t.wander > 0 ? 0 : size(0.08, 0.4);
    t.modulation = d.uniform(6 / t.duration, 0.3 * t.turning);
  }
  if (t.half == 0) t.whirl = size(0.1, 0.8);
  t.whirl_order = d.uniform(0.40, 0.48);
  return t;
}

/// Rotor angle at the samples, rad.
inline Eigen::VectorXd angle_of(Draw& d, const VibrationTruth& t, Eigen::Index n, Eigen::VectorXd& hertz) {
  const double dt = 1 / t.rate, slow = t.turning * d.uniform(0.15, 0.3), bend = d.uniform(0.8, 1.4);
  const Eigen::VectorXd drift = slow_wander(d, n, dt, 4);
  Eigen::VectorXd theta(n);
  hertz.resize(n);
  double angle = d.uniform(0, kTurn);
  for (Eigen::Index i = 0; i < n; ++i) {
    double part = static_cast<double>(i) / static_cast<double>(n - 1);
    if (t.down) part = 1 - part;
    hertz[i] = t.runs ? slow + (t.turning - slow) * std::pow(part, bend) : t.turning * (1 + 3e-4 * drift[i]);
    theta[i] = angle;
    angle += kTurn * hertz[i] * dt;
  }
  return theta;
}

}  // namespace vibration_detail

/// The record of a truth; `seed` draws phases, noise, critical speed and wander.
inline VibrationRecord make_vibration_record(const VibrationTruth& t, unsigned seed) {
  using namespace vibration_detail;
  using Complex = std::complex<double>;
  Draw d{std::mt19937_64(7919ull * seed + 13)};
  const auto n = static_cast<Eigen::Index>(std::lround(t.rate * t.duration));
  const double dt = 1 / t.rate;
  Eigen::VectorXd hertz;
  const Eigen::VectorXd theta = angle_of(d, t, n, hertz);
  // One critical speed within or above the run.
  const double critical = t.turning * d.uniform(0.6, 1.5), damping = d.uniform(0.04, 0.1);
  const auto response = [&](double f) {
    const double u = f / critical;
    return u * u / Complex(1 - u * u, 2 * damping * u);
  };
  double largest = 0;
  for (Eigen::Index i = 0; i < n; ++i) largest = std::max(largest, std::abs(response(hertz[i])));
  const Eigen::VectorXd phase = slow_wander(d, n, dt, d.uniform(0.7, 2));
  const Eigen::VectorXd slip = slow_wander(d, n, dt, 1.5), mains = slow_wander(d, n, dt, 10);
  const Complex unbalance = std::polar(1 / largest, d.uniform(0, kTurn)),
                out = std::polar(t.run_out, d.uniform(0, kTurn));
  double offsets[12];
  for (double& o : offsets) o = d.uniform(0, kTurn);
  double harmonic[7] = {};
  for (int k = 3; k <= 6; ++k) harmonic[k] = t.loose * (k == 3 ? 1 : d.uniform(0.3, 1));
  const double mains_offset = d.uniform(-0.05, 0.05);
  double electric = 0;
  Eigen::VectorXd x(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double turn = theta[i], f = hertz[i];
    const Complex one = t.runs ? unbalance * response(f) : std::polar(1.0, offsets[0]);
    double v = (one * std::polar(1.0, turn + t.wander * phase[i])).real() + (out * std::polar(1.0, turn)).real();
    v += t.second * std::cos(2 * turn + offsets[1]) + t.half * std::cos(0.5 * turn + offsets[2]);
    for (int k = 3; k <= 6; ++k) v += harmonic[k] * std::cos(k * turn + offsets[k]);
    electric += kTurn * (t.mains + mains_offset + 5e-3 * mains[i]) * dt;
    v += t.line * std::cos(electric + offsets[7]) + t.twice * std::cos(2 * electric + offsets[8]);
    const double swing = kTurn * t.modulation * dt * static_cast<double>(i) + offsets[9];
    if (t.sideband > 0) v += 2 * t.sideband * std::cos(swing) * std::cos(turn + offsets[0]);
    const bool whirls = !t.runs || f > 0.5 * t.turning;
    if (whirls) v += t.whirl * std::cos(t.whirl_order * turn + 0.5 * slip[i] + offsets[10]);
    x[i] = t.amplitude * (v + t.white * d.normal());
  }
  if (t.pink > 0) x += t.amplitude * t.pink * pink_noise(d, n);
  VibrationRecord r{t, {}};
  r.recording.dt = dt;
  r.recording.source = "vibration " + std::to_string(seed);
  r.recording.add("x", Quantity::displacement, x);
  if (t.encoder) {
    constexpr double kCounts = 2048;
    Eigen::VectorXd beta(n);
    for (Eigen::Index i = 0; i < n; ++i)
      beta[i] = kTurn / kCounts * (std::floor(std::fmod(theta[i], kTurn) / kTurn * kCounts) + 0.5);
    r.recording.add("beta", Quantity::angle, beta);
  } else {
    Eigen::VectorXd key(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      // Edges of a thousandth of a turn or one sample.
      const double at = std::fmod(theta[i], kTurn) / kTurn, edge = std::max(2e-3, hertz[i] * dt);
      key[i] = 5 * std::clamp(std::min(at, 0.1 - at) / edge, 0.0, 1.0);
    }
    r.recording.add("key", Quantity::voltage, key);
  }
  return r;
}

/// A record of a drawn truth; different seeds, different machines.
inline VibrationRecord draw_vibration_record(unsigned seed) {
  vibration_detail::Draw d{std::mt19937_64(104729ull * seed + 71)};
  return make_vibration_record(vibration_detail::draw_truth(d), seed);
}

}  // namespace whirl::testing
