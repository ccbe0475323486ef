#include "whirl/signal/derivative.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "odd_spectrum.hpp"
#include "whirl/core/error.hpp"

namespace whirl::signal {

Eigen::VectorXd central_difference(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, int order) {
  if (order != 2 && order != 4 && order != 6) {
    throw Error::in_field("order of the central difference", std::to_string(order), "2, 4 or 6");
  }
  const Eigen::Index n = x.size() - order;
  if (n < 1) throw Error::in_field("samples to differentiate", std::to_string(x.size()), "more than the order");
  const auto at = [&](int offset) { return x.segment(order / 2 + offset, n); };
  switch (order) {
    case 2:
      return (at(1) - at(-1)) / (2 * dt);
    case 4:
      return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * dt);
    default:
      return (45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + (at(3) - at(-3))) / (60 * dt);
  }
}

Eigen::VectorXd spectral_derivative(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, int k, double cutoff_hz) {
  if (k < 0 || k > 4) throw Error::in_field("derivative", std::to_string(k), "between 0 and 4");
  const double nyquist = 0.5 / dt;
  if (!(cutoff_hz > 0 && cutoff_hz <= nyquist)) {
    throw Error::in_field("cutoff", std::to_string(cutoff_hz) + " Hz",
                          "above 0 and at most half the sample rate, " + std::to_string(nyquist) + " Hz");
  }
  if (x.size() < 3) throw Error::in_field("samples to differentiate", std::to_string(x.size()), "at least 3");
  OddSpectrum s = odd_spectrum(x);
  const Eigen::Index n = x.size();
  const double line_hz = nyquist / static_cast<double>(n - 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double f = line_hz * static_cast<double>(i);
    const double edge = (f / cutoff_hz - 0.9) / 0.1;
    const double gain = edge <= 0 ? 1.0 : edge >= 1 ? 0.0 : 0.5 * (1 + std::cos(std::numbers::pi * edge));
    s.lines[i] *= gain * std::pow(std::complex<double>(0, 2 * std::numbers::pi * f), k);
  }
  Eigen::VectorXd y = inverse_spectrum(s.lines, n);
  if (k == 0) {
    for (Eigen::Index i = 0; i < n; ++i) y[i] += s.start + s.slope * static_cast<double>(i);
  } else if (k == 1) {
    y.array() += s.slope / dt;
  }
  return y;
}

Eigen::VectorXd total_variation_derivative(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double alpha,
                                           int iterations) {
  if (!(alpha > 0)) throw Error::in_field("total variation weight", std::to_string(alpha), "above 0");
  const Eigen::Index n = x.size();
  if (n < 3) throw Error::in_field("samples to differentiate", std::to_string(n), "at least 3");
  // With g = A u + x_0 as the unknown (g_0 = x_0 up to the fit), u_i = (g_{i+1} - g_i)/dt lives on the midpoints and
  // the normal equations are pentadiagonal: (I + D2' W D2) g = x, W = alpha / (dt |D2 g| / dt), lagged.
  const Eigen::Index m = n - 2;
  Eigen::VectorXd g = x;
  const double floor = 1e-8 * (x.maxCoeff() - x.minCoeff() + 1e-300);
  for (int it = 0; it < iterations; ++it) {
    // |u_{i+1} - u_i| = |D2 g|_i / dt.
    Eigen::VectorXd w(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      const double jump = g[i + 2] - 2 * g[i + 1] + g[i];
      w[i] = alpha / (dt * std::sqrt(jump * jump + floor * floor));
    }
    // Banded LDL' of I + D2' W D2.
    Eigen::VectorXd d0 = Eigen::VectorXd::Ones(n), d1 = Eigen::VectorXd::Zero(n), d2 = Eigen::VectorXd::Zero(n);
    for (Eigen::Index i = 0; i < m; ++i) {
      d0[i] += w[i];
      d0[i + 1] += 4 * w[i];
      d0[i + 2] += w[i];
      d1[i] -= 2 * w[i];
      d1[i + 1] -= 2 * w[i];
      d2[i] += w[i];
    }
    Eigen::VectorXd next = x;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double l1 = d1[i] / d0[i], l2 = d2[i] / d0[i];
      if (i + 1 < n) {
        d0[i + 1] -= l1 * d1[i];
        d1[i + 1] -= l1 * d2[i];
        next[i + 1] -= l1 * next[i];
      }
      if (i + 2 < n) {
        d0[i + 2] -= l2 * d2[i];
        next[i + 2] -= l2 * next[i];
      }
    }
    for (Eigen::Index i = n - 1; i >= 0; --i) {
      double v = next[i];
      if (i + 1 < n) v -= d1[i] * next[i + 1];
      if (i + 2 < n) v -= d2[i] * next[i + 2];
      next[i] = v / d0[i];
    }
    const double change = (next - g).norm();
    g = next;
    if (change <= 1e-10 * (g.norm() + 1e-300)) break;
  }
  Eigen::VectorXd u(n);
  u[0] = (g[1] - g[0]) / dt;
  u[n - 1] = (g[n - 1] - g[n - 2]) / dt;
  u.segment(1, n - 2) = (g.tail(n - 2) - g.head(n - 2)) / (2 * dt);
  return u;
}

}  // namespace whirl::signal
