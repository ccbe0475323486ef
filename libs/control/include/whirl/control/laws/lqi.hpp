#pragma once
#include <complex>

#include "whirl/control/lateral_model.hpp"
#include "whirl/control/laws/pd.hpp"
#include "whirl/control/laws/speed_table.hpp"

namespace whirl::control {

/// Linear-quadratic control with an integral state that turns with the rotor: eta' = i omega eta + z in the complex
/// coordinate, so that at a held speed the synchronous motion goes to zero whatever causes it,
///   a = -K_z(omega) z - K_v(omega) v - K_i(omega) eta - d.
/// The gains are complex, one Riccati equation for each of the speeds of a table. In the rotor's frame the state is
/// kept behind its gain and as an eccentricity q, so that a schedule that moves does not move the force:
///   q' = -K_i z e^{-i beta} / omega^2,  -K_i eta = q F(beta at effect).
/// Gains of a rotor that turns backwards are conjugate.
class TurningFeedback {
 public:
  static constexpr std::size_t kNodes = 12;
  using Table = SpeedTable<kNodes, 4>;  ///< K_z 1/s^2, K_v 1/s: real and imaginary parts
  TurningFeedback() = default;
  explicit TurningFeedback(const Table& gains) noexcept : gains_(gains) {}

  std::complex<double> step(std::complex<double> z, std::complex<double> v, double omega) noexcept {
    const auto k = gains_.at(omega);
    const double side = omega < 0 ? -1 : 1;
    return -(product({k[0], side * k[1]}, z) + product({k[2], side * k[3]}, v));
  }
  void reset() noexcept {}

 private:
  Table gains_;
};

/// The integral part.
class TurningIntegral {
 public:
  using Table = SpeedTable<TurningFeedback::kNodes, 2>;  ///< K_i 1/s^3: real and imaginary part
  TurningIntegral() = default;
  TurningIntegral(const Table& gains, double sample_time, double omega_min) noexcept
      : gains_(gains), h_(sample_time), omega_min_(omega_min) {}

  /// z, beta at the time of the sample; `forcing` = F at the time of effect. `adapt` false: sample lost or
  /// force at its limit.
  std::complex<double> step(std::complex<double> z, double beta, double omega, std::complex<double> forcing,
                            bool adapt) noexcept {
    const std::complex<double> out = product(q_, forcing);
    if (adapt && std::abs(omega) >= omega_min_) {
      const auto k = gains_.at(omega);
      q_ -= h_ / (omega * omega) * product({k[0], omega < 0 ? -k[1] : k[1]}, product(z, unit_phasor(-beta)));
    }
    return out;
  }
  void reset() noexcept { q_ = {}; }
  std::complex<double> eccentricity() const noexcept { return q_; }  ///< q, tends to -eps

 private:
  Table gains_;
  double h_ = 0, omega_min_ = 0;
  std::complex<double> q_;
};

struct IntegralRegulator {
  Pd x{0, 0}, y{0, 0};
  TurningFeedback linear;
  TurningIntegral synchronous;
};

}  // namespace whirl::control
