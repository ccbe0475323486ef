#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/rotor_model.hpp"
#include "whirl/identify/output_error_rotor.hpp"
#include "whirl/identify/rotor_record.hpp"

namespace whirl::identification {

/// Evidence for one term that the present model lacks.
struct ScoreCandidate {
  const TermEntry* term;
  int place = 0;  ///< of modes, decays and instants: of the list given, from 1; of runout: its order
  /// Drop of the residual sum of squares by the residual variance, divided by 1 + 0.18 (unknowns - 1), so that 16 is
  /// four sigma for a term of one, two or four real unknowns.
  double score = 0;
  /// Coefficient that a term with one real unknown would get, and its standard deviation; 0 for others.
  double value = 0, sd = 0;
  Eigen::VectorXd coefficient = {};  ///< of all real unknowns
  /// By how much k1, k2, c and then eps (real, imaginary) of every record move with that coefficient.
  Eigen::VectorXd moves = {};
};

struct ScoreTest {
  std::vector<ScoreCandidate> candidates;  ///< descending score
  /// Whitened residual variance of the weak equations at the present model, the sensitive alarm for model error: 1 when
  /// the model fits; it sees a broken symmetry or a mode long before the residual of the trajectory does.
  double chi_square = 0;
  double condition_number = 0;  ///< of the whitened, column-scaled weak equations

  const ScoreCandidate* find(const TermEntry& term) const;
};

struct ScoreTestOptions {
  double half_width = 0;             ///< of the test functions, s; 0: as WeakRotorOptions
  std::vector<ForcedMode> modes;     ///< candidates; participation is not used
  std::vector<DecayingMode> decays;  ///< candidates
  std::vector<RotorTerm> terms;      ///< candidates; the coefficients are not used
  bool sensor = false;               ///< candidates: errors of the probes
  std::vector<double> instants;      ///< s, at which forces that begin at one instant are tried; places count them
  /// Known accelerations of the main mode on the half grid, per record; empty: none.
  std::vector<Eigen::VectorXcd> forces;
  bool delay = true;         ///< candidate: the displacement channels lag the angle
  int runout_harmonics = 3;  ///< candidates: runout of order 1 .. n beyond those already in the model
};

/// Forward score test on whitened weak equations with instrumental variables: the columns of the terms already in the
/// model are correlated with the same columns built from the simulated, noise-free trajectory, so that noise in z does
/// not make partners of z look significant. For each candidate pair of columns Q (orthogonal to the active instruments)
///
///   score = ||Q^+ r||^2 in the metric of Q, r the residual, divided by the residual variance
///
/// `fit` must come from these records with `active` options. A column that the active terms span is skipped.
ScoreTest score_rotor_terms(const std::vector<RotorRecord>& records, const OutputErrorFit& fit,
                            const OutputErrorOptions& active, const ScoreTestOptions& options = {});

}  // namespace whirl::identification
