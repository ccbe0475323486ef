#pragma once
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

/// Driven oscillators of one degree of freedom, one displacement measured.
namespace whirl::testing {

struct Oscillator {
  std::string name;
  std::function<double(double x, double v, double t)> force;  ///< x'' without the drive
  double stiffness = 0, damping = 0, cubic = 0;               ///< of that force: -k x - c x' - k3 x^3
  double gain = 1;                                            ///< of the input
  double level = 1;                                           ///< rms of the input
};

/// Duffing springs, hardening and softening, and a nearly linear one; frequencies 2 to 5 Hz by `seed`.
inline std::vector<Oscillator> oscillators(unsigned seed) {
  std::mt19937_64 random(seed * 2654435761ULL + 5);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Oscillator> all;
  for (const auto& [name, bend] :
       {std::pair("hardening", 0.5), std::pair("softening", -0.12), std::pair("nearly linear", 0.05)}) {
    Oscillator o;
    o.name = name;
    const double w = 2 * std::numbers::pi * (2 + 3 * share(random)), size = 0.01 * (1 + share(random));
    o.stiffness = w * w;
    o.damping = 2 * (0.02 + 0.03 * share(random)) * w;
    o.cubic = bend * o.stiffness / (size * size);
    o.gain = 0.5 + share(random);
    o.level = 0.35 * size * w * std::sqrt(o.damping * w) / o.gain;
    const double k = o.stiffness, c = o.damping, k3 = o.cubic;
    o.force = [k, c, k3](double x, double v, double) { return -k * x - c * v - k3 * x * x * x; };
    all.push_back(o);
  }
  return all;
}

/// Record at 1/dt Hz with channels y, m, and u, m/s^2, a sum of 50 sines from 0.1 to 2.5 times the natural frequency:
/// symplectic steps (velocity Verlet, 20 a sample); white noise of `noise` times the spread of y.
inline Recording oscillator_record(const Oscillator& o, double dt, Eigen::Index samples, double noise, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi);
  std::normal_distribution<double> gauss;
  constexpr int sines = 50, fine = 20;
  std::vector<double> frequency, phases;
  for (int k = 0; k < sines; ++k) {
    frequency.push_back(std::sqrt(o.stiffness) * (0.1 + 2.4 * (k + 0.5) / sines));
    phases.push_back(phase(random));
  }
  const auto drive = [&](double t) {
    double u = 0;
    for (std::size_t k = 0; k < frequency.size(); ++k) u += std::sin(frequency[k] * t + phases[k]);
    return o.level * u / std::sqrt(0.5 * sines);
  };
  Eigen::VectorXd y(samples), u(samples);
  double x = 0, v = 0;
  const double h = dt / fine;
  double now = drive(0);
  for (Eigen::Index i = 0; i < samples; ++i) {
    y[i] = x;
    u[i] = now;
    for (int j = 0; j < fine; ++j) {
      const double t = dt * static_cast<double>(i) + h * j, next = drive(t + h);
      const double half = v + 0.5 * h * (o.force(x, v, t) + o.gain * now);
      x += h * half;
      // The damping needs the velocity of the end: one fixed-point step.
      const double guess = half + 0.5 * h * (o.force(x, half, t + h) + o.gain * next);
      v = half + 0.5 * h * (o.force(x, guess, t + h) + o.gain * next);
      now = next;
    }
  }
  const double spread = std::sqrt((y.array() - y.mean()).square().mean());
  for (double& value : y) value += noise * spread * gauss(random);
  Recording r;
  r.dt = dt;
  r.source = o.name;
  r.add("y", Quantity::displacement, y);
  r.add("u", Quantity::acceleration, u);
  return r;
}

}  // namespace whirl::testing
