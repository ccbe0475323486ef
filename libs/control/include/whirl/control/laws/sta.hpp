#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Super-twisting on s' = phi + u, |phi'| <= L (Levant 1998; gains of Moreno and Osorio 2012):
///   u = -k1 sig(s)^(1/2) + w,  w' = -k2 sgn s,  k1 = 1.5 sqrt(L),  k2 = 1.1 L.
struct SuperTwisting {
  double rate = 100;  ///< L, m/s^3
  double limit = 10;  ///< |w| <= limit, m/s^2: no wind-up under saturation
  double w = 0;       ///< state

  double k1() const noexcept { return 1.5 * std::sqrt(rate); }
  double k2() const noexcept { return 1.1 * rate; }
  /// Explicit Euler step; returns u of this sample.
  double explicit_step(double s, double h) noexcept {
    const double u = -k1() * sig(s, 0.5) + w;
    w = std::clamp(w - h * k2() * sgn(s), -limit, limit);
    return u;
  }
  /// Backward Euler step solved exactly (Brogliato, Polyakov, Efimov, IEEE TAC 2020).
  double implicit_step(double s, double h) noexcept;
};

/// Super-twisting sliding mode on s = v + C x: a = -f - C v + u. `implicit` chooses the discretisation.
struct SuperTwistingSmc {
  double surface_gain = 60;
  SuperTwisting twist;
  double sample_time = 1e-3;
  bool implicit = false;

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x;
    const double u = implicit ? twist.implicit_step(s, sample_time) : twist.explicit_step(s, sample_time);
    return {-in.f - surface_gain * in.v + u, s};
  }
  void reset() noexcept { twist.w = 0; }
};

}  // namespace whirl::control
