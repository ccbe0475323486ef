#pragma once
#include <string>
#include <vector>

#include "whirl/core/modal_model.hpp"

namespace whirl::modal {

/// How far the shape of a mode is from a real one.
struct ModeComplexity {
  double mpc = 1;  ///< modal phase collinearity, in [0, 1]: 1 for a shape whose points move in phase or antiphase
  double mpd = 0;  ///< modal phase deviation, rad: mean distance from the best straight line, weighted by amplitude
};
/// MPC: ((l1 - l2)/(l1 + l2))^2 of the eigenvalues l of [Re Im]^T [Re Im] (Pappa et al., 1993).
/// One component alone is always collinear.
ModeComplexity mode_complexity(const Eigen::Ref<const Eigen::VectorXcd>& shape);

/// Shapes of a modal model over its response points at one reference (or, with one response, over its references): one
/// column per mode.
struct ModeShapes {
  std::vector<std::string> points;
  Eigen::MatrixXcd value;  ///< points x modes, residues of receptance
};
ModeShapes mode_shapes(const ModalModel& model);

/// A mode of one model and the mode of another that it most resembles.
struct ModeMatch {
  std::size_t first = 0, second = 0;  ///< indices into the two models
  double frequency_change = 0;        ///< of the second against the first, relative
  double mac = 1;                     ///< of their shapes
};
/// For every mode of `first` the mode of `second` within 20 % of its frequency that has the largest MAC less the
/// relative distance in frequency; modes without one are left out. Throws Error unless both hold shapes over the same
/// points.
std::vector<ModeMatch> match_modes(const ModalModel& first, const ModalModel& second);

/// H_ij against H_ji.
struct Reciprocity {
  std::string first, second;  ///< the two points
  double difference = 0;      ///< norm(H_ij - H_ji) / norm(H_ij + H_ji) * 2
  double noise = 0;  ///< the difference that the variances stated explain (one standard deviation); 0 when unknown
};
/// Every pair of points that were both hit and measured.
std::vector<Reciprocity> check_reciprocity(const FrequencyResponse& frf);

/// Modes whose residue at a point driven and measured in one direction has the wrong sign: Im a < 0 there by passivity.
struct DrivePoint {
  std::string point;
  std::vector<std::size_t> wrong_modes;  ///< indices into the model
};
std::vector<DrivePoint> check_drive_points(const ModalModel& model);

/// FRFs that the others contradict, in words, with the slip that explains them (reversed, in g, exchanged, a name
/// twice). From two references and three modes on the residues of a mode over responses and references must be a
/// product of shape and participation. With two references a slip of one FRF cannot be told from the same slip of the
/// other one of its response: both are named. Empty where nothing is wrong, or where not every response was measured
/// from every reference.
std::vector<std::string> contradicting_channels(const ModalModel& model);

/// Warns in the model's summary where the FRFs contradict each other (`contradicting_channels`), reciprocity (by more
/// than 10 % and three standard deviations) or passivity at a drive point.
void warn_of_contradictions(const FrequencyResponse& frf, ModalModel& model);

}  // namespace whirl::modal
