#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/core/rotor_model.hpp"

namespace whirl::response {

/// Forward whirl z = A exp(i Omega t) of the isotropic rotor: |A|^2 ((k1 + k2 |A|^2 - Omega^2)^2 + c^2 Omega^2) =
/// |eps|^2 Omega^4, exact (no truncation). At a given |A| a quadratic in Omega^2, at a given Omega a cubic in |A|^2.
struct SynchronousPoint {
  double omega = 0;   ///< rad/s
  double radius = 0;  ///< |A|, m
  double phase = 0;   ///< of A against the eccentricity, rad; negative: the whirl lags
  bool stable = false;
};

/// All answers at one speed, smallest first: one or three. Throws Error for an anisotropic rotor or k1 <= 0.
std::vector<SynchronousPoint> synchronous_answers(const RotorModel& rotor, double omega);

/// Free whirl without damping: Omega(radius) = sqrt(k1 + k2 radius^2), rad/s; NaN where the root is not real.
double backbone(const RotorModel& rotor, double radius);

/// What the further modes of a rotor (RotorModel::modes) add to the motion that its sensors see at a constant speed:
/// the vector of exp(i Omega t), sum of participation_k Omega^2 / (omega_k^2 - Omega^2 + 2 i zeta_k omega_k Omega), m.
/// They are linear and forced by the unbalance alone, so it is added to the answer of the main mode.
std::complex<double> modes_vector(const RotorModel& rotor, double omega);
/// Radius of the motion that sensors see: main mode of `answer` and further modes, m.
double seen_radius(const RotorModel& rotor, const SynchronousPoint& answer);

/// Band over the covariance of (k1, k2, c, eps_re, eps_im): quantiles 2.5, 50 and 97.5 % of the lowest and of the
/// highest stable radius at every speed, and of each drawn rotor's own peak in the range, between the speeds too.
struct SynchronousBand {
  Eigen::VectorXd omega, low, middle,
      high;                               ///< of the answer that a slow run-up follows (smallest stable one from below)
  Eigen::VectorXd upper_low, upper_high;  ///< of the largest stable answer
  double peak_low = 0, peak_high = 0;     ///< m
};
SynchronousBand synchronous_band(const RotorModel& rotor, const std::vector<double>& covariance,
                                 const Eigen::VectorXd& omega, int draws = 1000, unsigned seed = 1);

}  // namespace whirl::response
