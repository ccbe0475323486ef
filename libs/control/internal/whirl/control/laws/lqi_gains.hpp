#pragma once
#include <complex>

namespace whirl::control {

/// What the turning regulator weights as 1.
struct LqiScales {
  double position = 1, velocity = 1, integral = 1, control = 1;  ///< m, m/s, m s, m/s^2
};

/// Gains of z'' = -k1 z - c z' + a, eta' = i omega eta + z, sampled with a held: minimises the sum of |z/position|^2 +
/// |v/velocity|^2 + |eta/integral|^2 + |a/control|^2.
struct LqiGains {
  std::complex<double> z, v, integral;  ///< 1/s^2, 1/s, 1/s^3
  double residual = 0;                  ///< of the Riccati equation, relative
  double spectral_radius = 0;           ///< of the closed loop without delay
};
LqiGains lqi_gains(double k1, double c, double omega, double sample_time, const LqiScales& scales);

}  // namespace whirl::control
