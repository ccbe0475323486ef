#pragma once
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
};

/// Output-error fit from the start given, then the forward score test: the most significant candidate is taken up and
/// all is refined and simulated again, until none reaches the threshold. A term that the trajectory does not confirm by
/// a likelihood ratio of the same size is refused. `search_modes`: forced modes of any frequency are candidates beside
/// those of the hammer test. When the first fit fails its summary says why.
GrownRotor grow_rotor(const std::vector<RotorRecord>& records, const RotorModel& start,
                      const std::vector<std::complex<double>>& start_eps, const OutputErrorOptions& active,
                      const RotorIdentifyOptions& options, bool search_modes);

}  // namespace whirl::identification::detail
