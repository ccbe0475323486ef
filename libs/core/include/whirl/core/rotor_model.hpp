#pragma once
#include <complex>
#include <vector>

namespace whirl {

/// A linear mode forced by the unbalance, seen by the sensors beside the main mode:
/// q'' + 2 zeta w q' + w^2 q = F, displacement contribution participation * q (complex: x + i y).
struct ForcedMode {
  double omega = 0;                    ///< undamped natural frequency, rad/s
  double zeta = 0;                     ///< damping ratio
  std::complex<double> participation;  ///< m of unbalance per unit q
  bool operator==(const ForcedMode&) const = default;
};

/// Lateral motion of a rotor on a nonlinear shaft, per unit mass, in the complex coordinate z = x + i y
/// (paper eqs. 2, 5, 13 with the sign corrections of docs/paper-errata.md):
///
///   z'' = -k1 z - k1_conj conj(z) - k2 |z|^2 z - c z' - c_conj conj(z') + eps F + offset_force + gain u
///   F   = e^{i beta} (beta'^2 - i beta'')
///
/// `*_conj` describe anisotropy: k1_conj = (Kx - Ky)/(2m) + i Kxy/m, and likewise for damping; zero for an isotropic
/// rotor.
struct RotorModel {
  double k1 = 0;                 ///< linear stiffness / mass, 1/s^2
  double k2 = 0;                 ///< cubic stiffness / mass, 1/(m^2 s^2)
  double c = 0;                  ///< damping / mass, 1/s
  std::complex<double> k1_conj;  ///< anisotropic stiffness, 1/s^2
  std::complex<double> c_conj;   ///< anisotropic damping, 1/s
  std::complex<double> eps;      ///< unbalance eccentricity e exp(i phase), m; phase measured from the angle zero
  std::complex<double> offset;   ///< equilibrium seen by the sensors, m (z is measured minus offset)
  double gain = 0;               ///< lateral acceleration per newton of actuator force, 1/kg; 0 when not known
  std::vector<ForcedMode> modes;

  double natural_frequency() const;  ///< sqrt(k1), rad/s; 0 when k1 <= 0
  double damping_ratio() const;      ///< c / (2 sqrt(k1))
  bool operator==(const RotorModel&) const = default;
};

}  // namespace whirl
