#pragma once
#include <complex>
#include <vector>

#include "growth/rotor_growth.hpp"
#include "terms/growing_model.hpp"

/// What a growing rotor model may take up, and the model with a term more or less.
namespace whirl::identification::detail {

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
/// Score that a term needs: with n more chances of four sigma the threshold grows by 2 ln n for the others.
double threshold_of(const TermEntry& term, double threshold);
/// Above it a rare term leads: twice the highest score of a usual term that is not refused, and the level of a mode
/// that is sought, because it is chosen among all.
double lead_over_usual(const std::vector<ScoreCandidate>& candidates, const std::vector<TermId>& refused,
                       double threshold);
/// Candidates to try next. Many look alike near resonance, so all whose score comes near the best are tried and the
/// trajectory decides. Rare terms are tried where `rare` says so and where they score above `lead`; `first`: also where
/// one scores above every usual term.
std::vector<TermId> next_terms(const std::vector<ScoreCandidate>& candidates, const Growth& growth,
                               const std::vector<TermId>& refused, double threshold, bool rare, bool first,
                               double lead);

}  // namespace whirl::identification::detail
