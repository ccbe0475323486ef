#pragma once
#include <functional>
#include <string>
#include <vector>

#include "whirl/io/json.hpp"
#include "whirl/sindy/evidence.hpp"
#include "whirl/sindy/validate.hpp"

namespace whirl::app {

/// What speaks for a model beside its own summary.
struct Evidence {
  HeldOut held_out;
  std::vector<CollinearGroup> collinear;
  std::vector<BoundOutcome> bounds;  ///< one per --sign and term
};

using Identify = std::function<IdentifiedModel(const std::vector<Recording>&)>;

/// Fits the part that is not held out and predicts the rest. A rotor's run is predicted from its own initial state,
/// another record's with its own unbalance (2 numbers) too.
HeldOut hold_out_rotor(const std::vector<Recording>& records, double share, const Identify& identify);
HeldOut hold_out_general(const std::vector<Recording>& records, double share, const Identify& identify);
/// Scores of a model on data not used for it; `what` describes them.
HeldOut predict_held_out(const IdentifiedModel& model, const Recording& test, std::string what, bool rotor,
                         const ValidateOptions& options = {});

/// Lines for a person: chi-square, condition number, collinear groups, held-out error.
std::string describe(const Evidence& evidence, const Summary& summary);
Json to_json(const Evidence& evidence);
/// "0.0221" or "diverges".
std::string show_error(double value);

}  // namespace whirl::app
