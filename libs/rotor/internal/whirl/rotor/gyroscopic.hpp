#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/core/angle_signal.hpp"

namespace whirl::rotor {

/// Stiffness of a massless shaft at the disk: force k11 z + k12 psi, moment k12 z + k22 psi.
struct ShaftStiffness {
  double k11 = 0;  ///< N/m
  double k12 = 0;  ///< N/rad = N m/m
  double k22 = 0;  ///< N m/rad

  /// Overhung disk at the free end; ei = bending stiffness, N m^2. k11 = 12 EI/L^3, k12 = -6 EI/L^2, k22 = 4
  /// EI/L.
  static ShaftStiffness cantilever(double ei, double length);
  /// Between two hinged bearings, the disk a from the lower and b from the upper one; from the flexibilities
  /// a^2 b^2, a b (b - a), a^2 - a b + b^2, all / (3 EI (a + b)).
  static ShaftStiffness hinged(double ei, double a, double b);
};

/// Rigid disk on a flexible shaft with four lateral degrees of freedom (Stodola, Green): deflection z = x + i
/// y and tilt psi of the disk axis, psi = dz/d(axial) = psi_x + i psi_y.
///
///   m z''                                     + c11 z'   + k11 z + k12 psi + k_cubic |z|^2 z = m eps F
///   Id psi'' - i Ip Omega psi'                + c22 psi' + k12 z + k22 psi                   = (Id - Ip) chi
///   F F = e^{i beta} (beta'^2 - i beta'')
///
/// Derived from H = Ip Omega n + Id n x n' with the driving torque along the tilted axis n, so that the
/// right-hand sides hold at varying speed too. For k12 = 0 the first line is the two-degree rotor of the
/// paper.
struct GyroscopicRotor {
  double mass = 1;       ///< m, kg
  double polar = 0;      ///< Ip, about the spin axis, kg m^2
  double diametral = 1;  ///< Id, about a diameter, kg m^2
  ShaftStiffness shaft;
  double damping = 0;        ///< c11, N s/m
  double tilt_damping = 0;   ///< c22, N m s/rad
  double cubic = 0;          ///< radial cubic stiffness, N/m^3
  std::complex<double> eps;  ///< eccentricity e exp(i phase), m
  std::complex<double> chi;  ///< angle between disk axis and shaft (couple unbalance), rad
};

/// Poles of the linear whirl at speed omega: z, psi ~ e^{s t}. Im > 0 is forward whirl, Im < 0 backward;
/// sorted by Im. A Campbell diagram is Im(poles) over omega.
Eigen::Vector4cd whirl_poles(const GyroscopicRotor& rotor, double omega);

/// Undamped critical speeds of unbalance excitation (forward whirl at Omega), rad/s ascending. One only when
/// Ip > Id.
std::vector<double> critical_speeds(const GyroscopicRotor& rotor);

/// Steady unbalance response of the linear rotor at constant speed: z = first e^{i beta}, psi = second e^{i
/// beta}.
Eigen::Vector2cd steady_unbalance(const GyroscopicRotor& rotor, double omega);

/// Transient response by RK4, one step per sample, from the linear steady state at the first speed.
struct GyroscopicResponse {
  double dt = 0;
  Eigen::VectorXcd z, dz;      ///< m, m/s
  Eigen::VectorXcd psi, dpsi;  ///< rad, rad/s
};
GyroscopicResponse simulate(const GyroscopicRotor& rotor, const AngleSignal& angle);

}  // namespace whirl::rotor
