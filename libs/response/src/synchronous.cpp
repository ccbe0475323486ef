#include "whirl/response/synchronous.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "covariance_draws.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;

void check(const RotorModel& r) {
  if (std::abs(r.k1_conj) > 0 || std::abs(r.c_conj) > 0)
    throw Error("the closed form is that of an isotropic rotor: use the response curve of the model");
  if (!(r.k1 > 0)) throw Error::in_field("k1", fmt::format("{:g} 1/s^2", r.k1), "> 0");
}

/// rho ((k - w)^2 + c^2 w) - e^2 w^2 with k = k1 + k2 rho, w = Omega^2, and its derivative by rho.
double balance(const RotorModel& r, double rho, double w) {
  const double d = r.k1 + r.k2 * rho - w;
  return rho * (d * d + r.c * r.c * w) - std::norm(r.eps) * w * w;
}
double slope(const RotorModel& r, double rho, double w) {
  const double d = r.k1 + r.k2 * rho - w;
  return d * d + r.c * r.c * w + 2 * rho * r.k2 * d;
}

/// In the rotating frame z = (A + a + i b) e^{i Omega t} the linear motion has constant coefficients.
bool is_stable(const RotorModel& r, double rho, double omega) {
  // a'' - 2 Omega b' + c a' - c Omega b + (k - w + 2 k2 rho) a = 0, b'' + 2 Omega a' + c b' + c Omega a + (k - w) b =
  // 0, k = k1 + k2 rho: s^4 + p3 s^3 + p2 s^2 + p1 s + p0, Routh and Hurwitz.
  const double w = omega * omega, k = r.k1 + r.k2 * rho - w, ka = k + 2 * r.k2 * rho, c = r.c;
  const double p3 = 2 * c, p2 = c * c + ka + k + 4 * w, p1 = c * (ka + k) + 4 * c * w, p0 = ka * k + c * c * w;
  return p3 > 0 && p0 > 0 && p1 > 0 && p3 * p2 > p1 && p1 * (p3 * p2 - p1) > p3 * p3 * p0;
}

SynchronousPoint point(const RotorModel& r, double rho, double omega) {
  const std::complex<double> receptance(r.k1 + r.k2 * rho - omega * omega, r.c * omega);
  return {omega, std::sqrt(rho), -std::arg(receptance), is_stable(r, rho, omega)};
}

/// Roots of the cubic in rho at one w, ascending, polished by Newton.
std::vector<double> roots(const RotorModel& r, double w) {
  const double d = r.k1 - w, c2w = r.c * r.c * w, e2w2 = std::norm(r.eps) * w * w;
  std::vector<double> found;
  if (e2w2 == 0) return {0};  // no unbalance, or standstill
  if (r.k2 == 0) return {e2w2 / (d * d + c2w)};
  // k2^2 rho^3 + 2 d k2 rho^2 + (d^2 + c2w) rho - e2w2, scaled by rho = x * unit.
  const double unit = std::max(std::cbrt(e2w2 / (r.k2 * r.k2)), std::abs(d / r.k2));
  const double a3 = r.k2 * r.k2 * unit * unit, a2 = 2 * d * r.k2 * unit, a1 = d * d + c2w, a0 = -e2w2 / unit;
  const double p = a2 / a3, q = a1 / a3, s = a0 / a3;
  const double qq = (p * p - 3 * q) / 9, rr = (2 * p * p * p - 9 * p * q + 27 * s) / 54;
  if (rr * rr < qq * qq * qq) {
    const double theta = std::acos(std::clamp(rr / std::sqrt(qq * qq * qq), -1.0, 1.0));
    for (const double turn : {0.0, 2 * M_PI, -2 * M_PI})
      found.push_back(-2 * std::sqrt(qq) * std::cos((theta + turn) / 3) - p / 3);
  } else {
    const double big = -std::copysign(std::cbrt(std::abs(rr) + std::sqrt(rr * rr - qq * qq * qq)), rr);
    found.push_back(big + (big != 0 ? qq / big : 0) - p / 3);
  }
  for (double& rho : found) {
    // Beside the others a small root drowns in rounding: Newton's steps begin at the linear answer.
    rho = std::abs(rho) < 1e-6 && a1 > 0 ? e2w2 / a1 : rho * unit;
    for (int k = 0; k < 4; ++k) {
      const double g = slope(r, rho, w);
      const double change = g != 0 ? balance(r, rho, w) / g : 0;
      if (std::abs(change) < 0.1 * std::abs(rho)) rho -= change;
    }
  }
  std::erase_if(found, [](double rho) { return !(rho >= 0); });
  std::sort(found.begin(), found.end());
  return found;
}

/// Largest radius of the answers whose radius has its maximum over speed in the range; 0 where none has. At a given
/// radius the balance is a quadratic in w: at a maximum its two roots meet, which is a quadratic in rho. A resonance
/// may be far narrower than the steps of a grid.
double own_peak(const RotorModel& r, double from, double to) {
  const double e2 = std::norm(r.eps), c2 = r.c * r.c;
  const double a = 4 * r.k2 * (e2 * r.k2 - c2), b = c2 * c2 - 4 * r.k1 * c2 + 8 * e2 * r.k1 * r.k2,
               d = 4 * e2 * r.k1 * r.k1, inner = b * b - 4 * a * d;
  if (!(inner >= 0)) return 0;
  const double q = -0.5 * (b + std::copysign(std::sqrt(inner), b));
  double most = 0;
  for (const double rho : {q / a, d / q}) {
    if (!std::isfinite(rho) || !(rho > e2)) continue;
    const double w = 0.5 * rho * (2 * (r.k1 + r.k2 * rho) - c2) / (rho - e2);
    if (w >= from * from && w <= to * to) most = std::max(most, rho);
  }
  return std::sqrt(most);
}

}  // namespace

std::complex<double> modes_vector(const RotorModel& rotor, double omega) {
  std::complex<double> sum = 0;
  for (const ForcedMode& m : rotor.modes)
    sum += m.participation * omega * omega /
           std::complex<double>(m.omega * m.omega - omega * omega, 2 * m.zeta * m.omega * omega);
  return sum;
}

double seen_radius(const RotorModel& rotor, const SynchronousPoint& answer) {
  return std::abs(std::polar(answer.radius, answer.phase + std::arg(rotor.eps)) + modes_vector(rotor, answer.omega));
}

std::vector<SynchronousPoint> synchronous_answers(const RotorModel& rotor, double omega) {
  check(rotor);
  std::vector<SynchronousPoint> points;
  for (const double rho : roots(rotor, omega * omega)) points.push_back(point(rotor, rho, omega));
  return points;
}

double backbone(const RotorModel& r, double radius) {
  const double w = r.k1 + r.k2 * radius * radius;
  return w >= 0 ? std::sqrt(w) : std::nan("");
}

SynchronousBand synchronous_band(const RotorModel& rotor, const std::vector<double>& covariance,
                                 const Eigen::VectorXd& omega, int draws, unsigned seed) {
  check(rotor);
  CovarianceDraws draw(rotor, covariance, seed);
  require_range("draws", draws, 20, 1e6);
  Eigen::MatrixXd lower(draws, omega.size()), upper(draws, omega.size());
  Eigen::VectorXd peaks(draws);
  for (int d = 0; d < draws; ++d) {
    const RotorModel r = draw();
    double peak = own_peak(r, omega.minCoeff(), omega.maxCoeff());
    for (Index k = 0; k < omega.size(); ++k) {
      const std::vector<double> rho = roots(r, omega[k] * omega[k]);
      lower(d, k) = rho.empty() ? 0 : std::sqrt(rho.front());
      upper(d, k) = rho.empty() ? 0 : std::sqrt(rho.back());
      peak = std::max(peak, upper(d, k));
    }
    peaks[d] = peak;
  }
  const auto quantile = [&](Eigen::VectorXd column, double q) {
    const auto at = column.data() + static_cast<Index>(q * (draws - 1) + 0.5);
    std::nth_element(column.data(), at, column.data() + draws);
    return *at;
  };
  SynchronousBand band{omega, omega, omega, omega, omega, omega, 0, 0};
  for (Index k = 0; k < omega.size(); ++k) {
    band.low[k] = quantile(lower.col(k), 0.025);
    band.middle[k] = quantile(lower.col(k), 0.5);
    band.high[k] = quantile(lower.col(k), 0.975);
    band.upper_low[k] = quantile(upper.col(k), 0.025);
    band.upper_high[k] = quantile(upper.col(k), 0.975);
  }
  band.peak_low = quantile(peaks, 0.025);
  band.peak_high = quantile(peaks, 0.975);
  return band;
}

}  // namespace whirl::response
