#pragma once

namespace whirl {

/// One classical Runge-Kutta step of order 4 for x' = f(t, x).
///
/// `State` needs `+` and `*` with a double (Eigen fixed-size vectors, std::complex, double). No allocation.
/// Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, table II.1.2.
template <class State, class F>
State rk4_step(F&& f, double t, const State& x, double h) {
  const State k1 = f(t, x);
  const State k2 = f(t + 0.5 * h, State(x + k1 * (0.5 * h)));
  const State k3 = f(t + 0.5 * h, State(x + k2 * (0.5 * h)));
  const State k4 = f(t + h, State(x + k3 * h));
  return State(x + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0));
}

}  // namespace whirl
