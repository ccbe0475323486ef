#pragma once
#include <cmath>

#include "whirl/rotor/equations.hpp"

namespace whirl::rotor {

/// Kinetic (paper eq. 2) plus elastic energy K1 rho^2 / 2 + K2 rho^4 / 4, J.
inline double mechanical_energy(const UnbalancedDisk& d, const DiskState& s) {
  const double e = d.eccentricity, sb = std::sin(s.beta + d.phase), cb = std::cos(s.beta + d.phase);
  const double gx = s.dx - e * s.omega * sb, gy = s.dy + e * s.omega * cb, rho2 = s.x * s.x + s.y * s.y;
  return 0.5 * d.mass * (gx * gx + gy * gy) + 0.5 * d.inertia_about_g() * s.omega * s.omega + 0.5 * d.stiffness * rho2 +
         0.25 * d.cubic * rho2 * rho2;
}

}  // namespace whirl::rotor
