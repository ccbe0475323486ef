#pragma once
#include <array>
#include <cmath>

#include "whirl/core/identified_model.hpp"
#include "whirl/rotor/equations.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {

inline IdentifiedModel rotor_model() {
  IdentifiedModel m;
  m.rotor = testing::design_of("pd", "lpf").model;
  m.rotor->k1_conj = {20, -15};
  m.rotor->offset = {3e-6, -8e-6};
  return m;
}

/// x'' = -k x - f sgn(x'), k = 400 1/s^2, f = 2 m/s^2.
inline IdentifiedModel friction_oscillator() {
  IdentifiedModel m;
  m.method = "test";
  m.states = {"X1", "X2"};
  const auto term = [](const char* function, double value) {
    return EquationTerm{function, {value, 0, value, value}, ""};
  };
  m.equations = {{"X2'", {term("X1", -400), term("sgn(X2)", -2)}}};
  return m;
}

/// Acceleration of the library's rotor.
inline std::array<double, 4> library_rate(const RotorModel& m, const std::array<double, 4>& x, const double* u) {
  const std::complex<double> a = rotor::lateral_acceleration(m, {x[0], x[2]}, {x[1], x[3]},
                                                             rotor::unbalance_forcing(u[0], u[1], u[2]), {u[3], u[4]});
  return {x[1], a.real(), x[3], a.imag()};
}

template <class Rate>
std::array<double, 4> rk4(const Rate& f, double t, const std::array<double, 4>& x, double h) {
  const auto along = [&](const std::array<double, 4>& k, double s) {
    std::array<double, 4> out = x;
    for (std::size_t i = 0; i < 4; ++i) out[i] += s * k[i];
    return out;
  };
  const auto k1 = f(t, x), k2 = f(t + h / 2, along(k1, h / 2)), k3 = f(t + h / 2, along(k2, h / 2)),
             k4 = f(t + h, along(k3, h));
  std::array<double, 4> out = x;
  for (std::size_t i = 0; i < 4; ++i) out[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  return out;
}

inline constexpr const char* kInputs[] = {"beta", "omega", "alpha", "ux", "uy"};

/// Inputs of the run-down at time t with forces of time `held`.
inline std::array<double, 5> plant_inputs(double t, double held) {
  return {120 * t - 3 * t * t, 120 - 6 * t, -6, 5 * std::sin(70 * held), 3 * std::cos(60 * held)};
}

}  // namespace whirl::deploy
