#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

namespace whirl::control {

/// sgn with sgn(0) = 0.
inline double sgn(double x) noexcept { return static_cast<double>((x > 0) - (x < 0)); }

/// sig(x)^a = |x|^a sgn x; sig(0)^a = 0 for every a.
inline double sig(double x, double a) noexcept { return x == 0 ? 0.0 : std::copysign(std::pow(std::abs(x), a), x); }

/// tanh x. Near zero, where a held rotor stays, by Lambert's continued fraction: within 1e-15 of it, without a call.
inline double smooth_sign(double x) noexcept {
  if (!(std::abs(x) < 0.5)) return std::tanh(x);
  const double s = x * x;
  return x * (135135 + s * (17325 + s * (378 + s))) / (135135 + s * (62370 + s * (3150 + s * 28)));
}

/// How the slope r |x|^(r-1), infinite at x = 0 for r < 1, is bounded.
enum class Regularisation {
  none,   ///< as printed in the paper; the slope at exactly x = 0 is taken as 0
  clamp,  ///< max(|x|, delta)^(r-1) in the slope, the surface itself unchanged
  blend,  ///< surface linear plus quadratic inside |x| < delta: value and slope are continuous and consistent
};

/// phi(x) = L sig(x/L)^r and its slope, the position part of the terminal surface (paper eq. 27), dimension
/// m.
///
/// The length unit L makes the surface gain a rate (1/s) whatever r is: a gain of 60 1/s with L = 1 mm is the
/// number 60 of a surface written in millimetres.
struct TerminalPower {
  double exponent = 0.7;  ///< r = q/p in (0, 1]
  double delta = 20e-6;   ///< regularisation length, m
  double length = 1e-3;   ///< L, m
  Regularisation regularisation = Regularisation::blend;

  struct Point {
    double value = 0;  ///< phi, m
    double slope = 0;  ///< dphi/dx
  };
  /// The power at `delta`, for steps that need it again and again: taken anew where a field has changed.
  class Edge {
   public:
    double of(const TerminalPower& p) noexcept {
      if (p.exponent != exponent_ || p.delta != delta_ || p.length != length_) {
        exponent_ = p.exponent, delta_ = p.delta, length_ = p.length;
        value_ = p.at_delta();
      }
      return value_;
    }

   private:
    double exponent_ = 0, delta_ = 0, length_ = 0, value_ = 0;
  };
  double at_delta() const noexcept { return std::pow(delta / length, exponent - 1); }
  /// phi and its slope from one power of the fields as they are now (two inside the clamp).
  Point at(double x) const noexcept {
    return point(x, [this] { return at_delta(); });
  }
  Point at(double x, Edge& edge) const noexcept {
    return point(x, [&] { return edge.of(*this); });
  }
  double value(double x) const noexcept { return at(x).value; }
  double slope(double x) const noexcept { return at(x).slope; }

 private:
  template <class Power>
  Point point(double x, Power&& power_at_delta) const noexcept {
    const double a = std::abs(x);
    if (regularisation == Regularisation::blend && a < delta) {
      const double bend = (exponent - 1) * a / delta, power = power_at_delta();
      return {power * x * ((2 - exponent) + bend), power * ((2 - exponent) + 2 * bend)};
    }
    if (regularisation == Regularisation::clamp && a < delta) {
      return {length * sig(x / length, exponent), exponent * std::pow(delta / length, exponent - 1)};
    }
    if (a == 0) return {};
    const double power = std::pow(a / length, exponent - 1);
    return {power * x, exponent * power};
  }
};

/// Largest loop gain k = h rho/eps of s[i+1] = s[i] - k s[i-n] that is stable: 2 sin(pi / (2 (2n + 1))), n
/// samples of delay beyond the hold (2, 1, 0.618 for n = 0, 1, 2).
inline double stable_gain_limit(int n) noexcept { return 2 * std::sin(std::numbers::pi / (2.0 * (2 * n + 1))); }

/// Largest loop gain without oscillation: n^n / (n+1)^(n+1) (1, 1/4, 4/27 for n = 0, 1, 2).
inline double smooth_gain_limit(int n) noexcept { return n == 0 ? 1.0 : std::pow(n, n) / std::pow(n + 1.0, n + 1); }

/// Thinnest boundary layer free of delay oscillation, m/s: eps >= h rho (n+1)^(n+1)/n^n.
inline double boundary_layer_limit(double h, double rho, int n) noexcept { return h * rho / smooth_gain_limit(n); }

/// Regularisation length, m, at which the velocity gain of the singular term keeps the sampled loop smooth:
/// L (h C r / k_max)^(1/(1-r)).
inline double regularisation_limit(double h, double surface_gain, double exponent, double length, int n) noexcept {
  if (exponent >= 1) return 0;
  return length * std::pow(h * surface_gain * exponent / smooth_gain_limit(n), 1 / (1 - exponent));
}

}  // namespace whirl::control
