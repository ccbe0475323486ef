#pragma once
#include <algorithm>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include "growth/absent_terms.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/output_error_rotor.hpp"
#include "whirl/identify/score_test.hpp"

namespace whirl::identification::detail {

/// Another model that explains the records nearly as well.
struct OtherReading {
  std::string taken;  ///< term in the model; empty: the model without `other`
  std::string other;  ///< term in its place
  Decider decider;
  OutputErrorFit fit;
};

/// A rotor model grown term by term on evidence.
struct GrownRotor {
  OutputErrorFit fit;
  OutputErrorOptions active;
  std::vector<std::string> added;
  bool mode_found = false;  ///< a mode within the speeds is among them
  std::vector<std::string> warnings;
  std::vector<OtherReading> others;
  ScoreTest test;                  ///< of the final model
  std::vector<AbsentTerm> absent;  ///< what the final model lacks
  bool bow = false;                ///< the runout at order 1 is a bow of the shaft: it explains the records better
  double chi_square = 0;           ///< of the weak equations
  double condition_number = 0;

  bool usable() const { return fit.summary.status != Status::unusable; }
  /// Chi-square of the weak equations or of the trajectory, the larger; infinite where there is no model.
  double misfit() const { return usable() ? std::max(chi_square, fit.summary.chi_square) : INFINITY; }
};

}  // namespace whirl::identification::detail
