#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/core/rotor_model.hpp"
#include "whirl/diagnosis/influence_prior.hpp"

namespace whirl::diagnosis {

/// Where the readings of a job stand on an identified rotor of one disk.
struct RotorReadings {
  double mass = 0;                 ///< of the disk, kg
  double radius = 0;               ///< of the added masses, m
  std::vector<double> speed = {};  ///< of each reading, rad/s, > 0
  std::vector<double> probe = {};  ///< angle of its probe, rad, counted with the rotation from the model's x axis
  double mark = 0;                 ///< angle of the zero of the masses when the rotor angle is zero, rad, counted alike
  double amplitude = 0;            ///< largest reading, m 0-p: where the cubic stiffness is judged; 0: not known
};

/// Influence of a mass on the disk on each reading (rows x 1, m/kg), of small motion: with z = A e^{i beta} + B e^{-i
/// beta} the probe at angle p reads the vector A e^{-ip} + conj(B) e^{ip}, where A and B follow from the model's linear
/// terms, anisotropic ones too. Further modes of the model are left out. Throws Error for a mass, radius or speed that
/// is not positive, or unequal numbers of speeds and probes.
Eigen::VectorXcd rotor_influence(const RotorModel& rotor, const RotorReadings& readings);

/// What the model knows of the influence: its mean and spread over the covariance of (k1, k2, c, eps_re, eps_im), row
/// by row; empty: none; and relative errors on top, as relative_prior: `common` (modal mass, gain, radius) and `each`.
/// The summary of `warnings` says where the cubic stiffness moves a coefficient by more than a fifth.
InfluencePrior rotor_prior(const RotorModel& rotor, const std::vector<double>& covariance,
                           const RotorReadings& readings, double common, double each, Summary& warnings,
                           int draws = 400, unsigned seed = 1);

}  // namespace whirl::diagnosis
