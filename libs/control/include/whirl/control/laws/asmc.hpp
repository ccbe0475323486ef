#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Adaptive gain (Plestan, Shtessel, Bregeault, Poznyak, IJC 2010) on s = v + C x, a = -f - C v - K
/// tanh(s/eps):
///   K' = rate |s| sgn(|s| - mu),  K_min <= K <= K_max; mu >= 4 K h keeps the sampled gain from growing on
///   its own ripple.
struct AdaptiveSmc {
  double surface_gain = 60, boundary_layer = 0.1;
  double rate = 2000;                    ///< Kbar, 1/s^2
  double dead_zone = 0.02;               ///< mu, m/s
  double gain_min = 0.1, gain_max = 10;  ///< m/s^2
  double sample_time = 1e-3;
  double gain = 0.1;  ///< K, state

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x;
    gain = std::clamp(gain + sample_time * rate * std::abs(s) * sgn(std::abs(s) - dead_zone), gain_min, gain_max);
    return {-(in.f + surface_gain * in.v + gain * smooth_sign(s / boundary_layer)), s};
  }
  void reset() noexcept { gain = gain_min; }
};

}  // namespace whirl::control
