#pragma once
#include <cmath>
#include <cstdint>
#include <random>
#include <string>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/integrate.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::testing {

/// Forced Duffing oscillator x'' = -x - x^3 - 0.3 x' + u, noise 1 %.
inline Recording duffing(Eigen::Index n = 3000, std::uint64_t seed = 1) {
  Recording r;
  r.dt = 0.02;
  const auto force = [](double t) { return 2 * std::cos(1.2 * t) + std::cos(0.7 * t + 1); };
  const auto rate = [&](double t, const Eigen::Vector2d& s) {
    return Eigen::Vector2d(s[1], -s[0] - std::pow(s[0], 3) - 0.3 * s[1] + force(t));
  };
  Eigen::VectorXd x(n), v(n), u(n);
  Eigen::Vector2d s(0.1, 0);
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0, 0.01);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = r.dt * static_cast<double>(i);
    x[i] = s[0] + normal(engine);
    v[i] = s[1] + normal(engine);
    u[i] = force(t);
    s = rk4_step(rate, t, s, r.dt);
  }
  r.add("x", Quantity::dimensionless, x);
  r.add("v", Quantity::dimensionless, v);
  r.add("u", Quantity::dimensionless, u);
  return r;
}

/// Of an equation's term; NaN where there is none.
inline double coefficient(const IdentifiedModel& m, const std::string& lhs, const std::string& function) {
  for (const Equation& e : m.equations) {
    for (const EquationTerm& t : e.terms) {
      if (e.lhs == lhs && t.function == function) return t.coefficient.value;
    }
  }
  return NAN;
}

}  // namespace whirl::testing
