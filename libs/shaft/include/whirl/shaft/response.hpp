#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

/// Deflection at rest under weight (9.80665 m/s^2 against y; none of a vertical rotor) and what the supports carry.
/// Empty where no support holds the rotor. Where magnets alone keep it from falling, it is that of the rotor held at
/// them, and their reactions are what they carry.
struct Sag {
  Eigen::VectorXd x, y;                    ///< at the nodes, m
  std::vector<Eigen::Vector2d> reactions;  ///< force of each support on its point `a`, N
};
Sag static_sag(const System& system);

/// x = Re(X e^{i theta}), y = Re(Y e^{i theta}): an ellipse.
struct Orbit {
  double major = 0;  ///< half axes, m
  double minor = 0;  ///< negative: backward
  double angle = 0;  ///< of the major axis from x towards y, rad, in (-pi/2, pi/2]
};
Orbit orbit(std::complex<double> x, std::complex<double> y);
/// What a probe at `angle` from x towards y reads: amplitude (peak) and phase, which leads the shaft's angle zero.
std::complex<double> probe_reading(std::complex<double> x, std::complex<double> y, double angle);

/// Steady response to unbalance and bow, column k at speed k.
struct Response {
  std::vector<double> speeds;       ///< rad/s
  Eigen::MatrixXcd x, y;            ///< nodes x speeds, m
  Eigen::MatrixXcd body_x, body_y;  ///< bodies x speeds, m
};
/// Solution of the full equations at each speed. Throws Error for a negative speed.
Response unbalance_response(const System& system, const std::vector<double>& speeds);

/// A resonance in a response over speed.
struct Peak {
  double speed = 0, amplitude = 0;  ///< rad/s, m
  /// Speed over the width of the peak at 0.707 of its height (API 684); NaN where the curve does not fall so far on
  /// both sides.
  double amplification = 0;
};
/// Local maxima of |values|, by a parabola through three points.
std::vector<Peak> peaks(const std::vector<double>& speeds, const Eigen::Ref<const Eigen::VectorXd>& amplitude);

}  // namespace whirl::shaft
