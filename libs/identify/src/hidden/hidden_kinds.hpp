#pragma once
#include <map>
#include <string>
#include <vector>

#include "whirl/identify/hidden_states.hpp"

namespace whirl::identification::detail {

/// A model with an unmeasured state more, at values to start from.
struct HiddenStart {
  std::string kind;
  IdentifiedModel model;
};

/// What the kinds need to know of the records.
struct HiddenScales {
  double rate = 1;                   ///< of the motion, rad/s
  std::vector<double> state_spread;  ///< rms about the mean of every state of the model without hidden states
  std::vector<double> input_size;    ///< rms of every input
};

/// Every kind of hidden state, named `name`, added to a model. Several starts each.
std::vector<HiddenStart> hidden_starts(const IdentifiedModel& model, const SindyOptions& options,
                                       const HiddenScales& scales, const std::string& name);

/// Candidate terms of all equations of a model with hidden states: those of the options, and products of hidden states
/// with what the kinds know, and what they spill above a level (`levels`, by hidden state).
std::vector<Equation> hidden_candidates(const IdentifiedModel& model, const SindyOptions& options,
                                        const std::map<std::string, std::vector<double>>& levels);

}  // namespace whirl::identification::detail
