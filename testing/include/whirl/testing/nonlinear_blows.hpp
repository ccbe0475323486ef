#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::testing {

/// A disc on a shaft whose stiffness hardens (or softens) with the deflection, on a structure with two linear modes,
/// hit by a hammer. Integrated sample by sample: no frequency response enters.
struct NonlinearBlowOptions {
  double hardening = 0.001;  ///< relative change of the frequency at the deflection after the average blow
  bool split = true;         ///< two rotor modes, 1 to 4 % apart; else one plane only
  int blows = 5;
  double spread = 0.25;  ///< of the blows' size, relative, uniform on both sides
  double noise = 0.02;   ///< sd of the accelerometers, m/s^2
  unsigned seed = 1;
};

struct NonlinearBlows {
  std::vector<Recording> blows;
  std::vector<std::complex<double>> poles;  ///< of small motion, Im > 0, rad/s
};

inline NonlinearBlows make_nonlinear_blows(const NonlinearBlowOptions& o) {
  std::mt19937_64 random(90'001ull * o.seed + 77);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const auto between = [&](double low, double high) { return low + (high - low) * uniform(random); };
  constexpr double kTurn = 2 * std::numbers::pi, kRate = 2048, kLength = 12;
  const double mass = between(1, 2), omega = kTurn * between(10, 16), zeta = between(0.005, 0.01);
  const double split = o.split ? between(0.01, 0.04) : 0;
  const double kx = mass * omega * omega * (1 + split), ky = mass * omega * omega * (1 - split);
  const double kc = o.split ? 0.25 * split * between(-1, 1) * mass * omega * omega : 0;
  const double cx = 2 * zeta * omega * mass * between(0.9, 1.1), cy = 2 * zeta * omega * mass * between(0.9, 1.1);
  const double force = between(70, 130), width = between(2.2e-3, 3e-3);
  const double deflection = force * width * 2 / std::numbers::pi / mass / omega;
  const double cubic = o.hardening * 2 * mass * omega * omega / (0.75 * deflection * deflection);
  struct Extra {
    double omega, zeta, gain;
  };
  const std::array<Extra, 2> extra{Extra{kTurn * between(38, 60), between(0.005, 0.01), between(0.02, 0.05) / mass},
                                   Extra{kTurn * between(100, 140), between(0.004, 0.01), between(0.01, 0.03) / mass}};

  NonlinearBlows result;
  Eigen::Matrix4d system;
  system << 0, 0, 1, 0, 0, 0, 0, 1, -kx / mass, -kc / mass, -cx / mass, 0, -kc / mass, -ky / mass, 0, -cy / mass;
  const Eigen::VectorXcd eigenvalues = Eigen::MatrixXd(system).eigenvalues();
  for (int i = 0; i < 4; ++i) {
    const bool seen =
        o.split || std::abs(std::abs(eigenvalues[i]) - std::sqrt(kx / mass)) < 1e-6 * omega || result.poles.empty();
    if (eigenvalues[i].imag() > 0 && seen && (o.split || result.poles.empty())) result.poles.push_back(eigenvalues[i]);
  }
  for (const Extra& e : extra)
    result.poles.push_back(e.omega * std::complex<double>(-e.zeta, std::sqrt(1 - e.zeta * e.zeta)));

  using State = Eigen::Matrix<double, 8, 1>;  // x, y, vx, vy, then (q, v) of each further mode
  for (int b = 0; b < o.blows; ++b) {
    const double peak = force * (1 + o.spread * between(-1, 1)), start = 0.05 + between(0, 1e-3);
    const auto pull = [&](double t) {
      return t > start && t < start + width ? peak * std::sin(std::numbers::pi * (t - start) / width) : 0.0;
    };
    const auto rate = [&](double t, const State& s) {
      const double f = pull(t), r2 = s[0] * s[0] + s[1] * s[1];
      State d;
      d[0] = s[2];
      d[1] = s[3];
      d[2] = (f - cx * s[2] - kx * s[0] - kc * s[1] - cubic * r2 * s[0]) / mass;
      d[3] = (-cy * s[3] - ky * s[1] - kc * s[0] - (o.split ? cubic * r2 * s[1] : 0)) / mass;
      for (int k = 0; k < 2; ++k) {
        const Extra& e = extra[static_cast<std::size_t>(k)];
        d[4 + 2 * k] = s[5 + 2 * k];
        d[5 + 2 * k] = e.gain * f - 2 * e.zeta * e.omega * s[5 + 2 * k] - e.omega * e.omega * s[4 + 2 * k];
      }
      return d;
    };
    const auto samples = static_cast<Eigen::Index>(kRate * kLength);
    Eigen::VectorXd hammer(samples), ax(samples), ay(samples);
    State s = State::Zero();
    for (Eigen::Index i = 0; i < samples; ++i) {
      const double t = static_cast<double>(i) / kRate;
      const State d = rate(t, s);
      hammer[i] = pull(t) + 0.01 * normal(random);
      ax[i] = d[2] + d[5] + d[7] + o.noise * normal(random);
      ay[i] = d[3] + 0.3 * d[5] - 0.4 * d[7] + o.noise * normal(random);
      constexpr int kSteps = 4;
      const double h = 1 / kRate / kSteps;
      for (int step = 0; step < kSteps; ++step) {
        const double at = t + step * h;
        const State k1 = rate(at, s), k2 = rate(at + h / 2, s + h / 2 * k1), k3 = rate(at + h / 2, s + h / 2 * k2),
                    k4 = rate(at + h, s + h * k3);
        s += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      }
    }
    Recording blow;
    blow.dt = 1 / kRate;
    blow.source = "blow" + std::to_string(b + 1);
    blow.add("hammer", Quantity::force, hammer);
    blow.add("acc_x", Quantity::acceleration, ax);
    blow.add("acc_y", Quantity::acceleration, ay);
    result.blows.push_back(std::move(blow));
  }
  return result;
}

}  // namespace whirl::testing
