#pragma once
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "whirl/core/recording.hpp"

/// Systems driven by a force that is a smooth function of time and known at the samples, few of them a cycle: a load
/// cell behind an anti-aliasing filter, the motion of a base.
namespace whirl::testing {

/// A force as a function of time, or a sum of cosines w t + phase.
class Force {
 public:
  template <class Of>
  requires std::is_invocable_r_v<double, Of, double> Force(Of of) : of_(std::move(of)) {}
  Force(std::vector<std::pair<double, double>> lines, double size) : lines_(std::move(lines)), size_(size) {}

  double operator()(double t) const {
    if (of_) return of_(t);
    double sum = 0;
    for (const auto& [w, phase] : lines_) sum += std::cos(w * t + phase);
    return sum * size_;
  }
  /// At t, t + h, ...: of cosines each line is turned from one to the next.
  std::vector<double> steps(double t, double h, std::size_t count) const {
    std::vector<double> out(count, 0.0);
    if (of_) {
      for (std::size_t k = 0; k < count; ++k) out[k] = of_(t + static_cast<double>(k) * h);
      return out;
    }
    for (const auto& [w, phase] : lines_) {
      double re = std::cos(w * t + phase), im = std::sin(w * t + phase);
      const double turn_re = std::cos(w * h), turn_im = std::sin(w * h);
      for (double& value : out) {
        value += re * size_;
        const double turned = re * turn_re - im * turn_im;
        im = re * turn_im + im * turn_re;
        re = turned;
      }
    }
    return out;
  }

 private:
  std::function<double(double seconds)> of_;
  std::vector<std::pair<double, double>> lines_;
  double size_ = 1;
};

/// Cosines of random frequencies and phases between two frequencies, rms 1.
inline Force noise_force(double low_hz, double high_hz, int lines, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> part(0, 1);
  std::vector<std::pair<double, double>> all;
  for (int k = 0; k < lines; ++k)
    all.emplace_back(2 * std::numbers::pi * (low_hz + (high_hz - low_hz) * part(random)),
                     2 * std::numbers::pi * part(random));
  return Force(std::move(all), std::sqrt(2.0 / lines));
}

/// A sine whose frequency rises linearly, rms 1.
inline Force sweep_force(double low_hz, double high_hz, double seconds, double phase) {
  return [=](double t) {
    return std::numbers::sqrt2 *
           std::cos(2 * std::numbers::pi * (low_hz * t + 0.5 * (high_hz - low_hz) / seconds * t * t) + phase);
  };
}

struct CoarseDrive {
  std::vector<std::string> names;  ///< states
  std::function<void(const double* x, double u, double* rate)> rate;
  std::vector<std::vector<std::pair<std::string, double>>> truth;  ///< terms of each equation
  double hertz = 100, seconds = 10;
};

/// Motion from rest: Gragg's midpoint rule, 32 and 64 steps a sample, extrapolated once. White
/// noise of `noise` times the spread of each state; the force "u" is exact.
inline Recording coarse_record(const CoarseDrive& s, const Force& force, double noise, std::uint64_t seed) {
  const std::size_t n = s.names.size();
  const double dt = 1 / s.hertz;
  std::vector<double> rate(n);
  // `u`: the force at 64 steps of the sample and its end.
  const auto gragg = [&](const std::vector<double>& start, const std::vector<double>& u, std::size_t steps) {
    const double h = dt / static_cast<double>(steps);
    const std::size_t apart = (u.size() - 1) / steps;
    std::vector<double> before = start, now = start, next(n);
    s.rate(start.data(), u[0], rate.data());
    for (std::size_t j = 0; j < n; ++j) now[j] += h * rate[j];
    for (std::size_t k = 1; k < steps; ++k) {
      s.rate(now.data(), u[k * apart], rate.data());
      for (std::size_t j = 0; j < n; ++j) next[j] = before[j] + 2 * h * rate[j];
      before = now;
      now = next;
    }
    s.rate(now.data(), u.back(), rate.data());
    for (std::size_t j = 0; j < n; ++j) next[j] = 0.5 * (now[j] + before[j] + h * rate[j]);
    return next;
  };
  const auto count = static_cast<Eigen::Index>(s.seconds * s.hertz);
  std::vector<double> x(n, 0.0);
  Eigen::MatrixXd values(count, static_cast<Eigen::Index>(n));
  Eigen::VectorXd u(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double t = dt * static_cast<double>(i);
    for (std::size_t j = 0; j < n; ++j) values(i, static_cast<Eigen::Index>(j)) = x[j];
    const std::vector<double> acting = force.steps(t, dt / 64, 65);
    u[i] = acting[0];
    const std::vector<double> coarse = gragg(x, acting, 32), fine = gragg(x, acting, 64);
    for (std::size_t j = 0; j < n; ++j) x[j] = fine[j] + (fine[j] - coarse[j]) / 3;
  }
  Recording r;
  r.dt = dt;
  r.source = "coarse drive";
  std::mt19937_64 random(seed * 104729 + 7);
  std::normal_distribution<double> gauss;
  for (std::size_t j = 0; j < n; ++j) {
    Eigen::VectorXd y = values.col(static_cast<Eigen::Index>(j));
    const double sd = noise * std::sqrt((y.array() - y.mean()).square().mean());
    for (double& v : y) v += sd * gauss(random);
    r.add(s.names[j], Quantity::dimensionless, y);
  }
  r.add("u", Quantity::dimensionless, u);
  return r;
}

/// A mass of 10 Hz and 1 % damping on a spring that hardens.
inline CoarseDrive hard_mass(double samples_a_cycle) {
  const double w = 2 * std::numbers::pi * 10, k = w * w, c = 2 * 0.01 * w, k3 = 0.3 * k;
  CoarseDrive s;
  s.names = {"x", "v"};
  s.rate = [=](const double* x, double u, double* rate) {
    rate[0] = x[1];
    rate[1] = -k * x[0] - c * x[1] - k3 * x[0] * x[0] * x[0] + 150 * u;
  };
  s.truth = {{{"v", 1}}, {{"x", -k}, {"v", -c}, {"x^3", -k3}, {"u", 150}}};
  s.hertz = 10 * samples_a_cycle;
  s.seconds = 15;
  return s;
}

/// Two masses of 7 and 12 Hz, the first driven.
inline CoarseDrive two_masses(double samples_a_cycle) {
  CoarseDrive s;
  s.names = {"x", "v", "y", "w"};
  s.rate = [](const double* x, double u, double* rate) {
    rate[0] = x[1];
    rate[1] = -4000 * x[0] + 1500 * x[2] - 1.5 * x[1] + 300 * u;
    rate[2] = x[3];
    rate[3] = 1500 * x[0] - 3500 * x[2] - 1.0 * x[3];
  };
  s.truth = {{{"v", 1}},
             {{"x", -4000}, {"y", 1500}, {"v", -1.5}, {"u", 300}},
             {{"w", 1}},
             {{"x", 1500}, {"y", -3500}, {"w", -1.0}}};
  s.hertz = 11.5 * samples_a_cycle;
  s.seconds = 12;
  return s;
}

/// A circuit that oscillates by itself (2 Hz), pulled by a signal.
inline CoarseDrive driven_van_der_pol(double samples_a_cycle) {
  CoarseDrive s;
  s.names = {"x", "v"};
  s.rate = [](const double* x, double u, double* rate) {
    rate[0] = x[1];
    rate[1] = -158 * x[0] + 3 * (1 - x[0] * x[0]) * x[1] + 60 * u;
  };
  s.truth = {{{"v", 1}}, {{"x", -158}, {"v", 3}, {"x^2*v", -3}, {"u", 60}}};
  s.hertz = 2 * samples_a_cycle;
  s.seconds = 25;
  return s;
}

}  // namespace whirl::testing
