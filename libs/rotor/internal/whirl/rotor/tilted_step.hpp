#pragma once
#include <Eigen/Core>
#include <complex>

#include "whirl/core/integrate.hpp"
#include "whirl/rotor/further_forces.hpp"

namespace whirl::rotor {

/// The tilt psi of the disk axis (gyroscopic.hpp) beside the deflection z, with the deflection's stiffness given as it
/// is felt by a slow pull, the disk free to tilt: k11 = K1 + k12^2 / k22.
///   z''   = (lateral_rate) + (further_rate) - (k12 / m) (psi + (k12 / k22) z)
///   psi'' = i (Ip / Id) Omega psi' - (c22 / Id) psi' - (k12 / Id) z - (k22 / Id) psi + (1 - Ip / Id) chi F
struct TiltCoefficients {
  double force = 0;             ///< k12 / m, m/(rad s^2)
  double rest = 0;              ///< k12 / k22, rad/m
  double gyro = 0;              ///< Ip / Id
  double damping = 0;           ///< c22 / Id, 1/s
  double moment = 0;            ///< k12 / Id, rad/(m s^2)
  double stiffness = 0;         ///< k22 / Id, 1/s^2
  std::complex<double> couple;  ///< (1 - Ip / Id) chi, rad
};

/// Deflection (m, m/s) and tilt (rad, rad/s) of the disk.
struct TiltedState {
  LateralState<double> disk{}, tilt{};
};

/// What acts on the disk at one instant.
struct TiltedInput {
  LateralInput<double> disk{};     ///< m/s^2: unbalance and actuators
  LateralInput<double> forcing{};  ///< F, 1/s^2
  double omega = 0;                ///< rotor speed, rad/s
  double time = 0;                 ///< s
};

inline TiltedState tilted_rate(const LateralCoefficients<double>& a, const FurtherForces<double>& f,
                               const TiltCoefficients& c, const TiltedState& s, const TiltedInput& in) noexcept {
  const bool dry = f.c2 != 0 || f.friction != 0;
  const LateralInput<double> more = further_rate(f, at_speed(f, in.omega, in.time), dry, s.disk);
  const LateralInput<double> z = lateral_rate(a, s.disk, {in.disk.x + more.x, in.disk.y + more.y});
  const double turn = c.gyro * in.omega, er = c.couple.real(), ei = c.couple.imag();
  return {{s.disk.vx, s.disk.vy, z.x - c.force * (s.tilt.x + c.rest * s.disk.x),
           z.y - c.force * (s.tilt.y + c.rest * s.disk.y)},
          {s.tilt.vx, s.tilt.vy,
           er * in.forcing.x - ei * in.forcing.y - turn * s.tilt.vy - c.damping * s.tilt.vx - c.moment * s.disk.x -
               c.stiffness * s.tilt.x,
           er * in.forcing.y + ei * in.forcing.x + turn * s.tilt.vx - c.damping * s.tilt.vy - c.moment * s.disk.y -
               c.stiffness * s.tilt.y}};
}

/// One classical Runge-Kutta step of length h; the inputs at its start, middle and end.
inline TiltedState tilted_step(const LateralCoefficients<double>& a, const FurtherForces<double>& f,
                               const TiltCoefficients& c, const TiltedState& s, const TiltedInput& in0,
                               const TiltedInput& in_mid, const TiltedInput& in1, double h) noexcept {
  using Vector = Eigen::Matrix<double, 8, 1>;
  const auto pack = [](const TiltedState& t) {
    Vector v;
    v << t.disk.x, t.disk.y, t.disk.vx, t.disk.vy, t.tilt.x, t.tilt.y, t.tilt.vx, t.tilt.vy;
    return v;
  };
  const auto unpack = [](const Vector& v) { return TiltedState{{v[0], v[1], v[2], v[3]}, {v[4], v[5], v[6], v[7]}}; };
  const Vector end = rk4_step(
      [&](double t, const Vector& v) {
        return pack(tilted_rate(a, f, c, unpack(v), t == 0 ? in0 : t < 0.75 * h ? in_mid : in1));
      },
      0.0, pack(s), h);
  return unpack(end);
}

}  // namespace whirl::rotor
