#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

/// Three-state flows with quadratic terms, drawn at random and integrated here: some trap their motion, some do not.
namespace whirl::testing {

using Point3 = std::array<double, 3>;
using Flow3 = std::function<Point3(const Point3&)>;

/// Lorenz's convection cell; its energy is preserved for equal weights.
inline Flow3 convection(std::uint64_t seed) {
  std::mt19937_64 draw(seed);
  const double prandtl = std::uniform_real_distribution(9.0, 11.0)(draw),
               rayleigh = std::uniform_real_distribution(27.0, 32.0)(draw),
               aspect = std::uniform_real_distribution(2.4, 2.9)(draw);
  return [=](const Point3& p) {
    return Point3{prandtl * (p[1] - p[0]), p[0] * (rayleigh - p[2]) - p[1], p[0] * p[1] - aspect * p[2]};
  };
}

/// Mean-field model of a cylinder's wake (Noack et al. 2003): a growing oscillation that moves the mean flow, which
/// stops it. `unlike`: factor of the states' units, so that the energy has other weights than 1.
inline Flow3 wake(std::uint64_t seed, double unlike) {
  std::mt19937_64 draw(seed);
  const double growth = std::uniform_real_distribution(0.08, 0.15)(draw),
               turn = std::uniform_real_distribution(0.8, 1.2)(draw),
               relax = std::uniform_real_distribution(0.7, 1.3)(draw);
  return [=](const Point3& p) {
    const double shift = p[2] * unlike;
    return Point3{(growth - shift) * p[0] - turn * p[1], turn * p[0] + (growth - shift) * p[1],
                  relax * ((p[0] * p[0] + p[1] * p[1]) / unlike - p[2])};
  };
}

/// A slow growth that ends in no bound: from here on x runs away in finite time.
inline Flow3 runaway(std::uint64_t seed) {
  std::mt19937_64 draw(seed);
  const double gain = std::uniform_real_distribution(0.2, 0.4)(draw);
  return [=](const Point3& p) {
    return Point3{-0.5 * p[0] + gain * p[0] * p[0] + 0.1 * p[1], -p[1] + p[2], -p[1] - 0.3 * p[2]};
  };
}

inline Point3 stepped(const Flow3& flow, const Point3& p, double h) {
  const auto along = [&](const Point3& slope, double by) {
    return Point3{p[0] + by * slope[0], p[1] + by * slope[1], p[2] + by * slope[2]};
  };
  const Point3 a = flow(p), b = flow(along(a, h / 2)), c = flow(along(b, h / 2)), d = flow(along(c, h));
  Point3 out;
  for (std::size_t i = 0; i < 3; ++i) out[i] = p[i] + h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  return out;
}

/// Channels x, y, z from `start`, ten steps a sample, with noise of `noise` times the rms about the mean.
inline Recording flow_record(const Flow3& flow, Point3 start, double dt, Eigen::Index samples, double noise,
                             std::uint64_t seed) {
  Eigen::MatrixXd clean(samples, 3);
  for (Eigen::Index i = 0; i < samples; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) clean(i, k) = start[static_cast<std::size_t>(k)];
    for (int step = 0; step < 10; ++step) start = stepped(flow, start, dt / 10);
  }
  std::mt19937_64 draw(seed);
  std::normal_distribution<double> normal;
  Recording r;
  r.dt = dt;
  const std::array<const char*, 3> names{"x", "y", "z"};
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double sd = noise * std::sqrt((clean.col(k).array() - clean.col(k).mean()).square().mean());
    Eigen::VectorXd column = clean.col(k);
    for (double& value : column) value += sd * normal(draw);
    r.add(names[static_cast<std::size_t>(k)], Quantity::dimensionless, column);
  }
  return r;
}

}  // namespace whirl::testing
