#pragma once
#include <string>
#include <vector>

#include "whirl/core/modal_model.hpp"
#include "whirl/diagnosis/influence_prior.hpp"

namespace whirl::diagnosis {

/// Where the readings and the planes of a job stand on a rotor whose modes were found from blows.
struct ModalReadings {
  std::vector<std::string> planes;  ///< points of the modes: a whole name, "disk:+X", or the part before the colon
  std::vector<std::string> probes;  ///< of each reading, alike
  std::vector<double> speed;        ///< of each reading, rad/s, > 0
  std::vector<double> angle;        ///< of each reading's probe, rad with the rotation from the angle zero
  double radius = 0;                ///< of the added masses, m
  double mark = 0;                  ///< angle of the zero of the masses when the rotor angle is zero, rad
};

/// Influence of a mass on each plane on each reading (readings x planes, m/kg): radius w^2 H(i w) e^{i (mark - angle)},
/// the receptance between the two points summed over the modes. Its residue is that of a channel between the two
/// points, either way round, or a(p, r) a(q, r) / a(r, r) over a point r at which the blow's own motion was measured.
/// Holds for a rotor whose two directions are alike and whose modes the speed does not move (no gyroscopic effect).
/// Channels with blow and motion along different axes are not used. Throws Error naming points that the modes do not
/// connect.
Eigen::MatrixXcd modal_influence(const ModalModel& modes, const ModalReadings& readings);

/// Mean and spread over the intervals of frequencies and damping, and relative errors on top as `relative_prior`.
InfluencePrior modal_prior(const ModalModel& modes, const ModalReadings& readings, double common, double each,
                           int draws = 400, unsigned seed = 1);

}  // namespace whirl::diagnosis
