#include "whirl/rotor/equations.hpp"

#include <cmath>

namespace whirl::rotor {

std::complex<double> unbalance_forcing(double beta, double omega, double alpha) {
  const double c = std::cos(beta), s = std::sin(beta), w2 = omega * omega;
  return {w2 * c + alpha * s, w2 * s - alpha * c};
}

Eigen::VectorXcd unbalance_forcing(const AngleSignal& angle) {
  Eigen::VectorXcd f(angle.beta.size());
  for (Eigen::Index i = 0; i < f.size(); ++i) f[i] = unbalance_forcing(angle.beta[i], angle.omega[i], angle.alpha[i]);
  return f;
}

RotorModel UnbalancedDisk::rotor_model() const {
  RotorModel m;
  m.k1 = stiffness / mass;
  m.k2 = cubic / mass;
  m.c = 0.5 * (damping_x + damping_y) / mass;
  m.c_conj = 0.5 * (damping_x - damping_y) / mass;
  m.eps = std::polar(eccentricity, phase);
  m.gain = 1 / mass;
  return m;
}

DiskAcceleration lagrange_acceleration(const UnbalancedDisk& d, const DiskState& s, double ux, double uy, double tau) {
  const double spring = d.stiffness + d.cubic * (s.x * s.x + s.y * s.y);
  const double fx = spring * s.x + d.damping_x * s.dx - ux;
  const double fy = spring * s.y + d.damping_y * s.dy - uy;
  const double cb = std::cos(s.beta + d.phase), sb = std::sin(s.beta + d.phase), w2 = s.omega * s.omega;
  const double alpha = (tau + d.eccentricity * (fy * cb - fx * sb)) / d.inertia_about_g();
  return {d.eccentricity * (alpha * sb + w2 * cb) - fx / d.mass, d.eccentricity * (-alpha * cb + w2 * sb) - fy / d.mass,
          alpha};
}

}  // namespace whirl::rotor
