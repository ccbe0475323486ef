#pragma once
#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"

namespace whirl::response {

/// One mode with the nonlinearities that a single sensor can tell apart, per unit of modal mass:
///
///   x'' + c x' + q |x'| x' + f sgn(x') + k1 x + k3 x^3 + k5 x^5 = u
///
/// At an amplitude a (peak) of the first harmonic, by averaging (Nayfeh and Mook 1979, ch. 3):
///
///   omega^2 = k1 + 3/4 k3 a^2 + 5/8 k5 a^4 + 3/4 k3 a a3    backbone: the nonlinear normal mode's frequency
///   2 delta = (c + 8/(3 pi) q omega a + 4/pi f/(omega a)) omega^2 / (k1 + k3 a^2 + k5 a^4)
///
/// delta = - a' / a is the rate of decay; the last factor is the energy that the loss has to take from the spring.
struct NonlinearMode {
  Estimate k1, c;   ///< 1/s^2, 1/s
  Estimate k3, k5;  ///< 1/(m^2 s^2), 1/(m^4 s^2); value 0 when the data do not ask for them
  Estimate q, f;    ///< 1/m, m/s^2; value 0 when not asked for
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  ///< of k1, k3, k5, c, q, f
  double chi_square = 0;  ///< of the points about both curves, by their own standard deviations
  /// How far the points lie off the curves beyond their noise, as parts of frequency and mean rate; 0 where chi-square
  /// is at most 2. The intervals hold it.
  double frequency_spread = 0, rate_spread = 0;
  double highest = 0, lowest = 0;  ///< amplitudes that the data covered, m
  Summary summary;

  double frequency(double amplitude) const;  ///< rad/s; NaN where the root is not real
  double rate(double amplitude) const;       ///< delta, 1/s
  /// States x, v, input u (force per unit mass, m/s^2).
  IdentifiedModel model() const;
};

/// Frequency and decay rate of a free decay at one time, from a window about it.
struct DecayPoint {
  double time = 0;                         ///< s
  double amplitude = 0;                    ///< of the first harmonic, peak
  double frequency = 0, frequency_sd = 0;  ///< of the motion, rad/s
  double rate = 0, rate_sd = 0;            ///< 1/s
  double length = 0;                       ///< s, of the window
};

struct DecayOptions {
  double from = -1;    ///< s; < 0: where the amplitude begins to fall
  double to = -1;      ///< s; < 0: where it is lost in the noise
  double periods = 8;  ///< in a window; windows do not overlap
  /// Samples that count; empty: all. The others (cut off, frozen, spikes) are left out of the windows, and windows with
  /// fewer than half of theirs are left out whole.
  Eigen::ArrayX<bool> usable = {};
};

struct DecayCurve {
  std::vector<DecayPoint> points;  ///< time ascending
  double from = 0, to = 0;         ///< s, used
  double noise = 0;                ///< sd of what the windows leave over
};

/// Fits to every window: offset + three harmonics of a phase with linear chirp under an amplitude whose logarithm is
/// quadratic in time, by nonlinear least squares; sd from the residual of the window. Throws Error when fewer than six
/// windows hold a decaying tone, with the reason.
DecayCurve decay_curve(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, const DecayOptions& options = {});

/// Weighted least squares of both curves; k3, k5, q, f are taken up one by one when their value exceeds four standard
/// deviations. Warns when the points scatter more than they should (chi-square above 2), and fails when the decay
/// shows that it is not one mode (chi-square above 100).
NonlinearMode fit_decay(const DecayCurve& curve);

/// Steady answers to a sine of known amplitude.
struct SteadyPoint {
  double omega = 0;                     ///< rad/s
  double force = 0;                     ///< u, amplitude (peak)
  double amplitude = 0;                 ///< of the first harmonic of x (peak)
  double phase = 0;                     ///< of x against u, rad, lead > 0; around -pi/2 at resonance
  double growth = 0;                    ///< a' / a while the sine is swept, 1/s
  double drift = 0;                     ///< rate of the phase while the sine is swept, rad/s
  double chirp = 0;                     ///< d omega / dt, rad/s^2
  std::complex<double> curvature = {};  ///< X'' / X of the complex amplitude while the sine is swept, 1/s^2
  double level = 0;                     ///< force level that the point belongs to, for figures; 0: `force`
};

struct SweptSineOptions {
  double periods = 6;                                  ///< of the sine in a window; windows do not overlap
  Eigen::ArrayX<bool> force_usable = {}, usable = {};  ///< samples of force and answer that count; as in a decay
};
/// Points of a record with a sine that is swept through the resonance, slowly or fast: windows about which phase and
/// frequency of the force are a quadratic, the complex amplitude of x too; slope, curvature and chirp correct the
/// balance, so that the sweep need not be quasi-static. Windows over a jump, of a tone
/// that is not there, or with a force that is no sine are left out. Throws Error for gaps, and for fewer than eight
/// windows with the reason.
std::vector<SteadyPoint> swept_sine_points(const Eigen::Ref<const Eigen::VectorXd>& force,
                                           const Eigen::Ref<const Eigen::VectorXd>& x, double dt,
                                           const SweptSineOptions& options = {});
/// One mode x'' + ... = g u from amplitude and phase at one or more force levels: linear least squares of the balance
/// of the first harmonic (stable and unstable answers alike), reweighted so that the errors of amplitude and phase are
/// equal parts of the amplitude. `gain` g: m/s^2 per unit of force. Throws Error for fewer than eight points.
NonlinearMode fit_steady(const std::vector<SteadyPoint>& points, Estimate& gain);

}  // namespace whirl::response
