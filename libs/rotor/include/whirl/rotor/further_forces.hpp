#pragma once
#include <cmath>
#include <type_traits>

#include "whirl/rotor/lateral_step.hpp"

namespace whirl::rotor {

/// Forces that a rotor may have beyond RotorModel, per unit mass, z = x + i y, w the rotor speed, t time:
///
///   f = - k3 |z|^4 z - k2_axis (x^3 + i y^3) - c2 |z'| z' - friction z' / sqrt(|z'|^2 + v0^2)
///       + gyroscopic i w z' - c_rotating (z' - i w z) + k_cross i z
///       - (k1_speed |w| + k1_drift (t - t0)) z - (c_speed |w| + c_drift (t - t0)) z'
///       - (kq_x x^2 + 2 kq_xxy x y + kq_xyy y^2) - i (kq_y y^2 + kq_xxy x^2 + 2 kq_xyy x y)
///
/// The last are the gradient of kq_x x^3 / 3 + kq_y y^3 / 3 + kq_xxy x^2 y + kq_xyy x y^2: springs that are stiffer to
/// one side.
/// Internal damping c_rotating: Genta, Dynamics of Rotating Systems (2005), section 4.6. T is double, or a vector of
/// lanes with one rotor each.
template <class T>
struct FurtherForces {
  T k3{};              ///< quintic stiffness, 1/(m^4 s^2)
  T k2_axis{};         ///< springs along the axes, 1/(m^2 s^2)
  T c2{};              ///< quadratic damping, 1/m
  T friction{};        ///< Coulomb friction, m/s^2
  T friction_speed{};  ///< v0, m/s: above 0 where there is friction
  T gyroscopic{};      ///< of a disc that tilts with its shaft
  T c_rotating{};      ///< damping that turns with the shaft, 1/s
  T k_cross{};         ///< seals, journal bearings, 1/s^2
  T k1_speed{};        ///< 1/(rad s)
  T c_speed{};         ///< 1/rad
  T k1_drift{};        ///< warming, 1/s^3
  T c_drift{};         ///< 1/s^2
  T drift_start{};     ///< t0, s: the time at which k1 and c hold
  T kq_x{};            ///< 1/(m s^2), as the next three
  T kq_y{};
  T kq_xxy{};
  T kq_xyy{};
};

/// Calls visit(a's number, b's number) for every one of them.
template <class A, class B, class Visit>
void each_force(A& a, B& b, Visit&& visit) {
  visit(a.k3, b.k3), visit(a.k2_axis, b.k2_axis), visit(a.c2, b.c2);
  visit(a.friction, b.friction), visit(a.friction_speed, b.friction_speed);
  visit(a.gyroscopic, b.gyroscopic), visit(a.c_rotating, b.c_rotating), visit(a.k_cross, b.k_cross);
  visit(a.k1_speed, b.k1_speed), visit(a.c_speed, b.c_speed);
  visit(a.k1_drift, b.k1_drift), visit(a.c_drift, b.c_drift), visit(a.drift_start, b.drift_start);
  visit(a.kq_x, b.kq_x), visit(a.kq_y, b.kq_y), visit(a.kq_xxy, b.kq_xxy), visit(a.kq_xyy, b.kq_xyy);
}

/// Whether there is any.
inline bool acts(const FurtherForces<double>& f) {
  return f.k3 != 0 || f.k2_axis != 0 || f.c2 != 0 || f.friction != 0 || f.gyroscopic != 0 || f.c_rotating != 0 ||
         f.k_cross != 0 || f.k1_speed != 0 || f.c_speed != 0 || f.k1_drift != 0 || f.c_drift != 0 || f.kq_x != 0 ||
         f.kq_y != 0 || f.kq_xxy != 0 || f.kq_xyy != 0;
}

/// What they are at one speed and time: springs and dampers of a linear rotor.
template <class T>
struct SpeedForces {
  T k, c;   ///< along z, 1/s^2, and z', 1/s
  T cross;  ///< along i z, 1/s^2
  T gyro;   ///< along i z', 1/s
};

template <class T>
inline SpeedForces<T> at_speed(const FurtherForces<T>& f, double omega, double time) {
  const double size = std::abs(omega);
  const T since = time - f.drift_start;
  return {f.k1_speed * size + f.k1_drift * since, f.c_rotating + f.c_speed * size + f.c_drift * since,
          f.k_cross + f.c_rotating * omega, f.gyroscopic * omega};
}

/// Square root of every lane.
template <class T>
inline T lane_root(T v) {
  if constexpr (std::is_same_v<T, double>) {
    return std::sqrt(v);
  } else {
    for (std::size_t i = 0; i < sizeof(T) / sizeof(double); ++i) v[i] = std::sqrt(v[i]);
    return v;
  }
}

/// Acceleration by the further forces, m/s^2. `dry`: with quadratic damping and friction.
template <class T>
inline LateralInput<T> further_rate(const FurtherForces<T>& f, const SpeedForces<T>& at, bool dry,
                                    const LateralState<T>& s) {
  const T xx = s.x * s.x, yy = s.y * s.y, square = xx + yy, twice = 2.0 * s.x * s.y;
  const T k = at.k + f.k3 * (square * square);
  T c = at.c;
  if (dry) {
    const T speed2 = s.vx * s.vx + s.vy * s.vy;
    c = c + f.c2 * lane_root(speed2) + f.friction / lane_root(speed2 + f.friction_speed * f.friction_speed);
  }
  return {-(k + f.k2_axis * xx) * s.x - c * s.vx - at.cross * s.y - at.gyro * s.vy -
              (f.kq_x * xx + f.kq_xxy * twice + f.kq_xyy * yy),
          -(k + f.k2_axis * yy) * s.y - c * s.vy + at.cross * s.x + at.gyro * s.vx -
              (f.kq_y * yy + f.kq_xxy * xx + f.kq_xyy * twice)};
}

/// lateral_step of a rotor with further forces, between `time` and `time` + h; `omega`: speed at its start, middle and
/// end, rad/s.
template <class T>
inline LateralState<T> lateral_step(const LateralCoefficients<T>& a, const FurtherForces<T>& f, bool dry,
                                    const double* omega, double time, const LateralState<T>& s,
                                    const LateralInput<T>& in0, const LateralInput<T>& in_mid,
                                    const LateralInput<T>& in1, double h) {
  const auto rate = [&](const LateralInput<T>& in, const SpeedForces<T>& at) {
    return [&](const LateralState<T>& state) {
      const LateralInput<T> more = further_rate(f, at, dry, state);
      return lateral_rate(a, state, LateralInput<T>{in.x + more.x, in.y + more.y});
    };
  };
  const SpeedForces<T> first = at_speed(f, omega[0], time), middle = at_speed(f, omega[1], time + 0.5 * h),
                       last = at_speed(f, omega[2], time + h);
  return second_order_step(rate(in0, first), rate(in_mid, middle), rate(in1, last), s, h);
}

}  // namespace whirl::rotor
