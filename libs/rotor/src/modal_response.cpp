#include "whirl/rotor/modal_response.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

namespace whirl::rotor {

using Complex = std::complex<double>;

namespace {

using Matrix5 = Eigen::Matrix<double, 5, 5>;

/// Exponential of the step matrix of (q, q', F, F', F''): the forcing over a step is F0 + F' t + F'' t^2 / 2.
Matrix5 step_of(double w, double zeta, double dt) {
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
  return e;
}

}  // namespace

Eigen::VectorXcd modal_response(double w, double zeta, const Eigen::VectorXcd& forcing, double dt, double omega0,
                                int derivative) {
  const Matrix5 e = step_of(w, zeta, dt);
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

std::vector<Eigen::VectorXcd> modal_responses(const std::vector<Pole>& poles, const Eigen::VectorXcd& forcing,
                                              double dt, double omega0, int derivative, Eigen::Index every) {
  constexpr int kLanes = 8;
  using Lanes = Eigen::Array<double, kLanes, 1>;
  struct Complexes {
    Lanes re, im;
  };
  std::array<std::array<Lanes, 5>, 2> e;  // row and column of the step matrix
  Complexes p, v;
  Lanes stiffness, damping;
  for (int k = 0; k < kLanes; ++k) {
    const auto [w, zeta] = poles[std::min(static_cast<std::size_t>(k), poles.size() - 1)];
    const Matrix5 step = step_of(w, zeta, dt);
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t j = 0; j < 5; ++j) e[i][j][k] = step(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    stiffness[k] = w * w, damping[k] = 2 * zeta * w;
    const Complex start = forcing[0] / Complex(w * w - omega0 * omega0, 2 * zeta * w * omega0);
    const Complex speed = Complex(0, omega0) * start;
    p.re[k] = start.real(), p.im[k] = start.imag(), v.re[k] = speed.real(), v.im[k] = speed.imag();
  }
  const Eigen::Index n = (forcing.size() + 1) / 2;
  std::vector<Eigen::VectorXcd> out(poles.size(), Eigen::VectorXcd((n + every - 1) / every));
  const auto put = [&](Eigen::Index i) {
    const Complex f = forcing[2 * i];
    const Lanes re = derivative == 0   ? p.re
                     : derivative == 1 ? v.re
                                       : Lanes(f.real() - damping * v.re - stiffness * p.re);
    const Lanes im = derivative == 0   ? p.im
                     : derivative == 1 ? v.im
                                       : Lanes(f.imag() - damping * v.im - stiffness * p.im);
    for (std::size_t k = 0; k < out.size(); ++k) out[k][i / every] = {re[static_cast<int>(k)], im[static_cast<int>(k)]};
  };
  const double per = 1 / dt;
  for (Eigen::Index i = 0;; ++i) {
    if (i % every == 0) put(i);
    if (i + 1 == n) return out;
    const Complex f0 = forcing[2 * i], fm = forcing[2 * i + 1], f1 = forcing[2 * i + 2];
    const Complex rate = (4.0 * fm - 3.0 * f0 - f1) * per, bend = 4.0 * (f0 + f1 - 2.0 * fm) * (per * per);
    const auto next = [&](std::size_t row, const Lanes& at, const Lanes& speed, double f, double r, double b) {
      return Lanes(e[row][0] * at + e[row][1] * speed + (e[row][2] * f + e[row][3] * r + e[row][4] * b));
    };
    const Complexes was = p;
    p.re = next(0, was.re, v.re, f0.real(), rate.real(), bend.real());
    p.im = next(0, was.im, v.im, f0.imag(), rate.imag(), bend.imag());
    v.re = next(1, was.re, v.re, f0.real(), rate.real(), bend.real());
    v.im = next(1, was.im, v.im, f0.imag(), rate.imag(), bend.imag());
  }
}

}  // namespace whirl::rotor
