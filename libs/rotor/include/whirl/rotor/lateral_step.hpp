#pragma once
#include "whirl/core/rotor_model.hpp"

namespace whirl::rotor {

/// The coefficients of RotorModel in real form, per unit mass. T is double, or a vector of lanes with one
/// rotor each.
template <class T>
struct LateralCoefficients {
  T kx, ky, kxy;  ///< linear stiffness, 1/s^2
  T k2;           ///< radial cubic stiffness, 1/(m^2 s^2)
  T cx, cy, cxy;  ///< damping, 1/s
};

inline LateralCoefficients<double> lateral_coefficients(const RotorModel& m) {
  return {m.k1 + m.k1_conj.real(), m.k1 - m.k1_conj.real(), m.k1_conj.imag(), m.k2,
          m.c + m.c_conj.real(),   m.c - m.c_conj.real(),   m.c_conj.imag()};
}

template <class T>
struct LateralState {
  T x, y, vx, vy;  ///< m, m/s
};
/// Acceleration by unbalance and actuators, m/s^2.
template <class T>
struct LateralInput {
  T x, y;
};

/// Acceleration of the main mode.
template <class T>
inline LateralInput<T> lateral_rate(const LateralCoefficients<T>& a, const LateralState<T>& s,
                                    const LateralInput<T>& in) {
  const T cubic = a.k2 * (s.x * s.x + s.y * s.y);
  return {in.x - (a.kx + cubic) * s.x - a.kxy * s.y - a.cx * s.vx - a.cxy * s.vy,
          in.y - (a.ky + cubic) * s.y - a.kxy * s.x - a.cy * s.vy - a.cxy * s.vx};
}

/// One classical Runge-Kutta step of length h of s'' = rate(s): `rate0`, `rate_mid`, `rate1` give the acceleration at
/// its start, middle and end. The position weights are merged: x1 = x0 + h v0 + h^2 (a1 + a2 + a3) / 6, which is the
/// same method for second-order equations and saves half of the work.
template <class T, class First, class Middle, class Last>
[[gnu::always_inline]] inline LateralState<T> second_order_step(const First& rate0, const Middle& rate_mid,
                                                                const Last& rate1, const LateralState<T>& s, double h) {
  const double half = 0.5 * h, quarter = 0.25 * h * h, sixth = h / 6, sixth2 = h * h / 6;
  const LateralInput<T> a1 = rate0(s);
  const T xh = s.x + half * s.vx, yh = s.y + half * s.vy;
  const LateralInput<T> a2 = rate_mid(LateralState<T>{xh, yh, s.vx + half * a1.x, s.vy + half * a1.y});
  const LateralInput<T> a3 =
      rate_mid(LateralState<T>{xh + quarter * a1.x, yh + quarter * a1.y, s.vx + half * a2.x, s.vy + half * a2.y});
  const LateralInput<T> a4 = rate1(LateralState<T>{s.x + h * s.vx + half * h * a2.x, s.y + h * s.vy + half * h * a2.y,
                                                   s.vx + h * a3.x, s.vy + h * a3.y});
  return {s.x + h * s.vx + sixth2 * (a1.x + a2.x + a3.x), s.y + h * s.vy + sixth2 * (a1.y + a2.y + a3.y),
          s.vx + sixth * (a1.x + 2.0 * (a2.x + a3.x) + a4.x), s.vy + sixth * (a1.y + 2.0 * (a2.y + a3.y) + a4.y)};
}

/// The same for a rotor: `in0`, `in_mid`, `in1` are the inputs at the start, middle and end.
template <class T>
inline LateralState<T> lateral_step(const LateralCoefficients<T>& a, const LateralState<T>& s,
                                    const LateralInput<T>& in0, const LateralInput<T>& in_mid,
                                    const LateralInput<T>& in1, double h) {
  const auto rate = [&](const LateralInput<T>& in) {
    return [&](const LateralState<T>& state) { return lateral_rate(a, state, in); };
  };
  return second_order_step(rate(in0), rate(in_mid), rate(in1), s, h);
}

}  // namespace whirl::rotor
