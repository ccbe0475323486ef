#include "whirl/rotor/modal_response.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

namespace whirl::rotor {

using Complex = std::complex<double>;

Eigen::VectorXcd modal_response(double w, double zeta, const Eigen::VectorXcd& forcing, double dt, double omega0,
                                int derivative) {
  // Exponential of the step matrix of (q, q', F, F', F''): the forcing over a step is F0 + F' t + F'' t^2 / 2.
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  Matrix5 m = Matrix5::Zero();
  m(0, 1) = m(1, 2) = m(2, 3) = m(3, 4) = dt;
  m(1, 0) = -w * w * dt;
  m(1, 1) = -2 * zeta * w * dt;
  // Scaling and squaring of the Taylor series: norms stay below 1/4 after 2^-s. Done in the time scale of the step,
  // so that q' and the forcing derivatives do not spread over many magnitudes.
  const double norm = m.cwiseAbs().rowwise().sum().maxCoeff();
  const int squarings = std::max(0, static_cast<int>(std::ceil(std::log2(norm / 0.25))));
  m *= std::ldexp(1.0, -squarings);
  Matrix5 e = Matrix5::Identity(), power = Matrix5::Identity();
  for (int k = 1; k <= 14; ++k) {
    power = power * m / k;
    e += power;
  }
  for (int k = 0; k < squarings; ++k) e = e * e;

  const Eigen::Index n = (forcing.size() + 1) / 2;
  Eigen::VectorXcd q(n);
  Complex p = forcing[0] / Complex(w * w - omega0 * omega0, 2 * zeta * w * omega0);
  Complex v = Complex(0, omega0) * p;
  for (Eigen::Index i = 0;; ++i) {
    q[i] = derivative == 0 ? p : derivative == 1 ? v : forcing[2 * i] - 2 * zeta * w * v - w * w * p;
    if (i + 1 == n) return q;
    const Complex f0 = forcing[2 * i], fm = forcing[2 * i + 1], f1 = forcing[2 * i + 2];
    const Complex rate = (4.0 * fm - 3.0 * f0 - f1) / dt, bend = 4.0 * (f0 + f1 - 2.0 * fm) / (dt * dt);
    const Complex next = e(0, 0) * p + e(0, 1) * v + e(0, 2) * f0 + e(0, 3) * rate + e(0, 4) * bend;
    v = e(1, 0) * p + e(1, 1) * v + e(1, 2) * f0 + e(1, 3) * rate + e(1, 4) * bend;
    p = next;
  }
}

}  // namespace whirl::rotor
