#pragma once
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "growth/rotor_growth.hpp"
#include "output_error/rotor/output_error_problem.hpp"

/// What a growing rotor model may take up, and the model with a term more or less.
namespace whirl::identification::detail {

inline const std::string kBow = "bow of the shaft", kAbove = "modes above the speeds", kFirstHighPass = "AC coupling",
                         kSecondHighPass = "AC coupling of second order";

struct CandidateMode {
  ForcedMode mode;
  bool searched;       // not from the hammer test
  bool open = true;    // not yet in the model, nor too near to one that is
  bool above = false;  // one mode in the place of all above the speeds; its frequency is tried, not fitted
};
struct CandidateDecay {
  DecayingMode mode;
  bool open = true;
};

/// The state of the growing model.
struct Growth {
  OutputErrorOptions active;
  RotorModel start;
  double delay = 0;
  std::vector<CandidateMode> modes;  ///< terms "mode 1", ...: a term names one place of the list for good
  std::vector<CandidateDecay> decays;
  std::vector<RotorTerm> terms;  ///< all candidate forces
  bool bow = false;              ///< the runout at order 1 is a bow
  KnownForces forces = {};       ///< of the bow
};

/// Values that a fit may start from.
struct Start {
  RotorModel model;
  std::vector<RotorTerm> terms;
  std::vector<std::complex<double>> eps;
  double delay = 0;
};

/// Modes of the hammer test that are not the main one (within 3 % of it).
std::vector<CandidateMode> hammer_modes(const RotorIdentifyOptions& options, double main_frequency);
/// Frequencies to search, a half-power width of 2 % damping apart, away from the main mode.
std::vector<CandidateMode> searched_modes(double top_speed, double main_frequency);
/// The residual of all modes above the speeds (as modal analysis calls it: their motion follows the force): one mode,
/// at several frequencies to try, times `highest`, of the speeds and the main mode. Only the first is open: in the
/// score test they look alike.
std::vector<CandidateMode> modes_above(double highest);
/// Where a fit ended.
Start start_of(const OutputErrorFit& fit);
/// The candidate forces; scales of their own are those of this motion.
std::vector<RotorTerm> candidate_terms(const std::vector<RotorRecord>& records, double main_frequency);
/// The growing model with a term of the score test.
Growth with_term(Growth g, const std::string& term, const RotorIdentifyOptions& options);
/// The growing model without a term; nothing where the term cannot be taken out alone.
std::optional<Growth> without_term(Growth g, const std::string& term);
/// Name for reports: modes and decays by their frequency.
std::string label(const std::string& term, const Growth& g);
/// Whether it is the mode in the place of all above the speeds.
bool is_above(const std::string& term, const Growth& g);
/// A term that was a candidate before the forces and sensor axes of rotor_terms.hpp.
bool is_special(const std::string& term);
/// Score that a term needs: with n more chances of four sigma the threshold grows by 2 ln n for the others.
double threshold_of(const std::string& term, const Growth& g, double threshold);
/// Candidates to try next. Many look alike near resonance, so all whose score comes near the best are tried and the
/// trajectory decides.
std::vector<std::string> next_terms(const ScoreTest& test, const Growth& growth,
                                    const std::vector<std::string>& refused, double threshold);

}  // namespace whirl::identification::detail
