#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

/// Driven oscillators with a cubic spring whose records hold what one set of coefficients cannot give: a stiffness that
/// changes, channels that are not read at the same instants, or a state that is not quite the rate of another.
namespace whirl::testing {

struct DrivenOscillator {
  double stiffness = 1, damping = 0.1, cubic = 0.5, gain = 1;
  double leak = 0;  ///< x' = v - leak x

  std::map<std::string, double> truth() const {
    std::map<std::string, double> all{
        {"x': v", 1}, {"v': x", -stiffness}, {"v': v", -damping}, {"v': x^3", -cubic}, {"v': u", gain}};
    if (leak != 0) all["x': x"] = -leak;
    return all;
  }
};

/// Natural frequency 0.3 to 0.8 Hz, damping ratio 3 to 10 %, a cubic force of the size of the linear one.
inline DrivenOscillator drawn_oscillator(unsigned seed) {
  std::mt19937_64 random(seed * 2654435761ull + 3);
  const auto between = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const double omega = 2 * std::numbers::pi * between(0.3, 0.8);
  return {omega * omega, 2 * between(0.03, 0.1) * omega, between(0.5, 1.5) * omega * omega, between(0.5, 2)};
}

struct DrivenRun {
  unsigned seed = 1;
  double seconds = 40, dt = 0.02, noise = 0.02;  ///< noise: sd by the spread of each channel
  double correlation = 0;                        ///< of the noise from sample to sample
  double late = 0;                               ///< samples by which v is read after x and u
  std::function<double(double)> stiffness = {};  ///< factor over time
  double unmeasured = 0;  ///< second force, by the spread of u: a sine at 1.3 times the natural frequency, not in u
};

/// x, v and a force u of 25 sines up to twice the natural frequency; Heun's rule, 40 steps a sample.
inline Recording driven_record(const DrivenOscillator& o, const DrivenRun& run) {
  constexpr int kSteps = 40, kSines = 25;
  std::mt19937_64 random(run.seed * 7919ull + 11);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> unit(0, 1);
  using Sines = Eigen::Array<double, kSines, 1>;
  Sines rate, phase, size;
  const double natural = std::sqrt(o.stiffness);
  for (int k = 0; k < kSines; ++k) {
    rate[k] = natural * (0.1 + 1.9 * (k + unit(random)) / kSines);
    phase[k] = 2 * std::numbers::pi * unit(random);
    size[k] = 0.35 * o.stiffness / o.gain * std::sqrt(2.0 / kSines) * (0.5 + unit(random));
  }
  const double h = run.dt / kSteps;
  const Sines turn_cos = (h * rate).cos(), turn_sin = (h * rate).sin();
  // At the ends of the steps of one sample, each sine turned on from the last.
  const auto forces = [&](double t) {
    std::array<double, kSteps + 1> all;
    Sines sine = (rate * t + phase).sin(), cosine = (rate * t + phase).cos();
    for (double& one : all) {
      one = (size * sine).sum();
      const Sines turned = sine * turn_cos + cosine * turn_sin;
      cosine = cosine * turn_cos - sine * turn_sin;
      sine = turned;
    }
    return all;
  };
  const auto pull = [&](double x, double v, double t, double force) {
    const double k = o.stiffness * (run.stiffness ? run.stiffness(t) : 1);
    const double other = run.unmeasured == 0
                             ? 0
                             : 0.35 * o.stiffness * run.unmeasured * std::sqrt(2.0) * std::sin(1.3 * natural * t + 0.5);
    return o.gain * force + other - k * x - o.damping * v - o.cubic * x * x * x;
  };
  const auto samples = static_cast<Eigen::Index>(std::lround(run.seconds / run.dt));
  Eigen::VectorXd x(samples), v(samples), u(samples);
  double position = 0.3 * gauss(random), speed = 0;
  const int later = static_cast<int>(std::lround(run.late * kSteps));
  for (Eigen::Index i = 0; i < samples; ++i) {
    x[i] = position;
    const std::array<double, kSteps + 1> force = forces(run.dt * static_cast<double>(i));
    u[i] = force[0];
    for (std::size_t k = 0; k < kSteps; ++k) {
      if (static_cast<int>(k) == later) v[i] = speed;
      const double t = run.dt * static_cast<double>(i) + h * static_cast<double>(k);
      const double pace = speed - o.leak * position, first = pull(position, speed, t, force[k]);
      const double ahead = position + h * pace, faster = speed + h * first;
      position += 0.5 * h * (pace + faster - o.leak * ahead);
      speed += 0.5 * h * (first + pull(ahead, faster, t + h, force[k + 1]));
    }
  }
  for (Eigen::VectorXd* y : {&x, &v}) {
    const double sd = run.noise * std::sqrt((y->array() - y->mean()).square().mean());
    double now = gauss(random);
    for (double& value : *y) {
      value += sd * now;
      now = run.correlation * now + std::sqrt(1 - run.correlation * run.correlation) * gauss(random);
    }
  }
  Recording r;
  r.dt = run.dt;
  r.add("x", Quantity::dimensionless, x);
  r.add("v", Quantity::dimensionless, v);
  r.add("u", Quantity::dimensionless, u);
  return r;
}

}  // namespace whirl::testing
