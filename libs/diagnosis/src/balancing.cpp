#include "whirl/diagnosis/balancing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/core/magnitude.hpp"

namespace whirl::diagnosis {
namespace {

/// Magnitudes of the eccentricity, and turns from its mean, within 1.96 standard deviations in the plane.
struct Region {
  double smallest = INFINITY, largest = 0;  // m
  double least_turn = 0, most_turn = 0;     // rad
  double size_sd = 0, turn_sd = 0;
};

/// Around an eccentricity that is large beside its deviation this is value +- 1.96 sd; two readings that lie as far
/// apart as the eccentricity is large (a bow or runout) make a region that magnitude and angle bend, up to one around
/// zero, where any angle may be right.
Region region_of(std::complex<double> eps, double re, double cross, double im) {
  constexpr double k95 = 1.959963984540054;
  constexpr int kPoints = 720;
  Region r;
  // Axes of the ellipse.
  const double middle = 0.5 * (re + im), half = std::hypot(0.5 * (re - im), cross);
  const double turned = 0.5 * std::atan2(2 * cross, re - im);
  const double a = k95 * std::sqrt(std::max(middle + half, 0.0)), b = k95 * std::sqrt(std::max(middle - half, 0.0));
  for (int k = 0; k < kPoints; ++k) {
    const double t = 2 * std::numbers::pi * k / kPoints;
    const std::complex<double> at = eps + std::complex(a * std::cos(t), b * std::sin(t)) * std::polar(1.0, turned);
    r.smallest = std::min(r.smallest, std::abs(at));
    r.largest = std::max(r.largest, std::abs(at));
    const double turn = std::arg(at / eps);
    r.least_turn = std::min(r.least_turn, turn);
    r.most_turn = std::max(r.most_turn, turn);
  }
  // Zero in standard deviations of its direction. A true size of zero lies within 1.96 of them in 95 % of all cases
  // where the errors have that direction alone, and within 2.45 where they have all directions alike.
  constexpr double kCircle = 2.447747;
  const std::complex<double> zero = -eps * std::polar(1.0, -turned), beside = zero * std::complex<double>(0, 1);
  const double least = std::max(b, 1e-12 * a);
  const auto deviations = [&](std::complex<double> z) { return std::hypot(z.real() / a, z.imag() / least) * k95; };
  const double apart = deviations(zero), round = std::min(1.0, apart / deviations(beside));
  if (a > 0) r.largest = std::max(r.largest, magnitude_estimate(std::abs(eps), std::abs(eps) / apart).high);
  if (a > 0 && apart <= k95 + round * (kCircle - k95)) {
    r.smallest = 0;
    r.least_turn = -std::numbers::pi;
    r.most_turn = std::numbers::pi;
  }
  r.size_sd = 0.5 * (r.largest - r.smallest) / k95;
  r.turn_sd = 0.5 * (r.most_turn - r.least_turn) / k95;
  return r;
}

}  // namespace

BalancingAdvice balancing_advice(const RotorModel& model, double mass, double radius, double service_speed,
                                 double wanted_grade, const std::vector<double>& covariance) {
  require_range("mass", mass, 1e-9, 1e9, "kg");
  require_range("radius", radius, 1e-6, 1e3, "m");
  require_range("service_speed", service_speed, 1e-6, 1e6, "rad/s");
  require_range("wanted_grade", wanted_grade, 1e-3, 1e5, "mm/s");
  BalancingAdvice a;
  const double e = std::abs(model.eps);
  a.unbalance = mass * e;
  a.heavy_angle = std::arg(model.eps);
  a.correction_mass = a.unbalance / radius;
  a.correction_angle = std::arg(-model.eps);
  a.grade = 1e3 * e * service_speed;
  a.permitted_unbalance = mass * wanted_grade * 1e-3 / service_speed;
  a.within_grade = a.grade <= wanted_grade;
  if (covariance.size() == 25 && e > 0) {
    const Region region = region_of(model.eps, covariance[18], covariance[19], covariance[24]);
    a.mass_interval = Estimate{a.correction_mass, mass * region.size_sd / radius, mass * region.smallest / radius,
                               mass * region.largest / radius};
    a.angle_interval = Estimate{a.correction_angle, region.turn_sd, a.correction_angle + region.least_turn,
                                a.correction_angle + region.most_turn};
  }
  return a;
}

}  // namespace whirl::diagnosis
