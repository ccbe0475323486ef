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

/// One classical Runge-Kutta step of length h; `in0`, `in_mid`, `in1` are the inputs at its start, middle and
/// end. The position weights are merged: x1 = x0 + h v0 + h^2 (a1 + a2 + a3) / 6, which is the same method
/// for second-order equations and saves half of the work.
template <class T>
inline LateralState<T> lateral_step(const LateralCoefficients<T>& a, const LateralState<T>& s,
                                    const LateralInput<T>& in0, const LateralInput<T>& in_mid,
                                    const LateralInput<T>& in1, double h) {
  const double half = 0.5 * h, quarter = 0.25 * h * h, sixth = h / 6, sixth2 = h * h / 6;
  const LateralInput<T> a1 = lateral_rate(a, s, in0);
  const T xh = s.x + half * s.vx, yh = s.y + half * s.vy;
  const LateralInput<T> a2 = lateral_rate(a, LateralState<T>{xh, yh, s.vx + half * a1.x, s.vy + half * a1.y}, in_mid);
  const LateralInput<T> a3 = lateral_rate(
      a, LateralState<T>{xh + quarter * a1.x, yh + quarter * a1.y, s.vx + half * a2.x, s.vy + half * a2.y}, in_mid);
  const LateralInput<T> a4 =
      lateral_rate(a,
                   LateralState<T>{s.x + h * s.vx + half * h * a2.x, s.y + h * s.vy + half * h * a2.y, s.vx + h * a3.x,
                                   s.vy + h * a3.y},
                   in1);
  return {s.x + h * s.vx + sixth2 * (a1.x + a2.x + a3.x), s.y + h * s.vy + sixth2 * (a1.y + a2.y + a3.y),
          s.vx + sixth * (a1.x + 2.0 * (a2.x + a3.x) + a4.x), s.vy + sixth * (a1.y + 2.0 * (a2.y + a3.y) + a4.y)};
}

}  // namespace whirl::rotor
