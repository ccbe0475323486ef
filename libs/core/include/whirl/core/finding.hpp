#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace whirl {

/// What a step learned about its result that a later step may have to decide on. Decisions read the code and the
/// amounts; `text` makes the sentence, for people.
enum class FindingCode {
  motion_unexplained,      ///< free runs leave a share of the motion beyond the noise
  model_error,             ///< the whitened residual is larger than the noise
  held_out_not_predicted,  ///< a model of the rest does not predict the part held out
  held_out_diverges,       ///< its free run diverges there
  held_out_missed,         ///< it predicts that part, but not to the noise
  held_out_not_tried,      ///< there was no prediction
  parameter_differs,       ///< a parameter by all records differs from that without the part held out
  parts_differ,            ///< parts of the records give different coefficients
  term_too_large,          ///< a term has a size that machines with such a term do not have
  inertia_impossible,      ///< moments of inertia that no disc has
  model_not_trusted,       ///< the model that the result was derived from is not to be trusted
  part_left_out,           ///< the model has a part that this result does not take into account
  readings_differ,         ///< the records allow another reading of the model, which changes this result
  held_out_cannot_check,   ///< the records without the part held out do not pass a resonance of the model
  work_limit,              ///< a fit ended at its limit of work: parts of the result may be missing
  freedom_spent,           ///< an option leaves one spare run or none: its fit may hide a wrong reading
  option_not_taken,        ///< an automatic option was left out: it would have done so
  not_repeatable,          ///< runs with nearly the same masses read differently
  run_contradicted,        ///< the other runs contradict a run
  runs_undecided,          ///< runs contradict each other, and nothing tells which is wrong
  angles_reversed,         ///< all runs agree far better with mass angles counted the other way
  scatter_unknown,         ///< no run repeats what another one tells: no interval
  sense_not_stated,        ///< it is not stated which way phases and mass angles count, and the runs do not show it
  answer_ambiguous,        ///< other masses explain the readings as well
  requirement_missed,      ///< a controller does not meet a requirement of its certificate
  sliding_bound_missed,    ///< the switching gain is not above the disturbance: a reaching condition does not hold
};
/// As it stands in JSON and Python, e.g. "held_out_missed".
std::string_view to_string(FindingCode code);

/// What follows from a finding.
enum class Consequence {
  note,      ///< said beside the result; it may be used as it is
  warning,   ///< the result may be used with it in mind
  no_trust,  ///< the result must not be relied on beyond the records it comes from
  unusable,  ///< the numbers mean nothing
};
std::string_view to_string(Consequence consequence);

/// A number with its name and SI unit; "" where it has none.
struct Amount {
  std::string name;
  double value = 0;
  std::string unit = {};
};

struct Finding {
  FindingCode code = FindingCode::model_error;
  Consequence consequence = Consequence::warning;
  std::vector<Amount> amounts = {};
  std::string where = {};  ///< the parameter, channel, state or part of the records concerned; empty: all

  /// Amount of that name; NaN when the finding has none.
  double amount(std::string_view name) const;
};

/// What the finding says, one sentence without a full stop: code, place and amounts in words.
std::string text(const Finding& finding);
/// What a result with a finding that takes the trust may be trusted for, one sentence.
std::string trust_text(const Finding& finding);

}  // namespace whirl
