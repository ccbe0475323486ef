#pragma once
#include <complex>
#include <string>
#include <vector>

#include "output_error/rotor/output_error_problem.hpp"

/// A rotor model that grows term by term.
namespace whirl::identification::detail {

/// A term of the search: an entry and, of those that have several, which of them.
struct TermId {
  const TermEntry* entry = nullptr;
  int place = 0;  ///< in the list of modes or decays, or the order, from 1
  bool operator==(const TermId&) const = default;
};

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
  std::vector<CandidateMode> modes;  ///< a term names one place of the list for good
  std::vector<CandidateDecay> decays;
  std::vector<RotorTerm> terms;  ///< all candidate forces
  bool bow = false;              ///< the runout at order 1 is a bow
  KnownForces forces = {};       ///< of the bow

  CandidateMode& mode(int place) { return modes[static_cast<std::size_t>(place - 1)]; }
  const CandidateMode& mode(int place) const { return modes[static_cast<std::size_t>(place - 1)]; }
};

/// The growing model with a term of the search.
Growth with_term(Growth growth, const TermId& term, bool poles);
/// Without one; nothing where it cannot be taken out alone.
std::optional<Growth> without_term(Growth growth, const TermId& term);
/// Name for reports: modes and decays by their frequency.
std::string label(const TermId& term, const Growth& growth);

}  // namespace whirl::identification::detail
