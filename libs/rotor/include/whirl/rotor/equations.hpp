#pragma once
#include <Eigen/Core>
#include <complex>

#include "whirl/core/angle_signal.hpp"
#include "whirl/core/rotor_model.hpp"

namespace whirl::rotor {

/// F = e^{i beta} (beta'^2 - i beta''): acceleration of the centre of mass per metre of eccentricity,
/// rad/s^2.
std::complex<double> unbalance_forcing(double beta, double omega, double alpha);
/// The same on the whole half-sample grid: entry 2 i at sample i, entry 2 i + 1 between.
Eigen::VectorXcd unbalance_forcing(const AngleSignal& angle);

/// Right-hand side of RotorModel without modes: z'' for given z, z', F and lateral force u (N).
/// Written in real arithmetic, because the product of two std::complex tests for NaN.
inline std::complex<double> lateral_acceleration(const RotorModel& m, std::complex<double> z, std::complex<double> dz,
                                                 std::complex<double> forcing, std::complex<double> u = {}) noexcept {
  const double x = z.real(), y = z.imag(), vx = dz.real(), vy = dz.imag();
  const double k = m.k1 + m.k2 * (x * x + y * y);
  const double kr = m.k1_conj.real(), ki = m.k1_conj.imag(), cr = m.c_conj.real(), ci = m.c_conj.imag();
  const double er = m.eps.real(), ei = m.eps.imag(), fr = forcing.real(), fi = forcing.imag();
  return {-k * x - m.c * vx - kr * x - ki * y - cr * vx - ci * vy + er * fr - ei * fi + m.gain * u.real(),
          -k * y - m.c * vy + kr * y - ki * x + cr * vy - ci * vx + er * fi + ei * fr + m.gain * u.imag()};
}

/// The rotor of paper section III as a body: a disk of mass m whose centre of mass G lies `eccentricity` from
/// the shaft centre C at the angle beta + phase.
struct UnbalancedDisk {
  double mass = 1;          ///< m, kg
  double inertia = 1;       ///< J about C, kg m^2; J_bar = J - m e^2 about G
  double stiffness = 0;     ///< K1, N/m
  double cubic = 0;         ///< K2, N/m^3
  double damping_x = 0;     ///< C_x, N s/m
  double damping_y = 0;     ///< C_y, N s/m
  double eccentricity = 0;  ///< e, m
  double phase = 0;         ///< angle of CG in the rotor frame, rad

  double inertia_about_g() const { return inertia - mass * eccentricity * eccentricity; }
  /// Lateral motion per unit mass, angle prescribed.
  RotorModel rotor_model() const;
};

/// States of paper eq. 22.
struct DiskState {
  double x = 0, dx = 0, y = 0, dy = 0, beta = 0, omega = 0;  ///< m, m/s, rad, rad/s
};
struct DiskAcceleration {
  double ddx = 0, ddy = 0, alpha = 0;  ///< m/s^2, m/s^2, rad/s^2
};

/// Lagrange's equations of the three degrees of freedom (paper eq. 5, corrected: docs/paper-errata.md),
///
///   x''     =  e beta'' sin b + e beta'^2 cos b - F_x / m
///   y''     = -e beta'' cos b + e beta'^2 sin b - F_y / m           b = beta + phase
///   J_bar beta'' = tau + e (F_y cos b - F_x sin b)
///
/// F = stiffness (eq. 13) + damping - control force u. Eq. 5 as printed leaves out the last bracket.
DiskAcceleration lagrange_acceleration(const UnbalancedDisk& disk, const DiskState& state, double ux, double uy,
                                       double tau);

}  // namespace whirl::rotor
