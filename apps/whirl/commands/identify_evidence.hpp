#pragma once
#include <functional>
#include <string>
#include <vector>

#include "whirl/identify/evidence.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/io/json.hpp"

namespace whirl::app {

/// What speaks for a model beside its own summary.
struct Evidence {
  identification::HeldOut held_out;
  std::vector<identification::CollinearGroup> collinear;
  std::vector<identification::BoundOutcome> bounds;  ///< one per --sign and term
};

using Identify = std::function<IdentifiedModel(const std::vector<Recording>&)>;

/// Fits the part that is not held out and predicts the rest. A rotor's run is predicted from its own initial state,
/// another record's with its own unbalance (2 numbers) too.
identification::HeldOut hold_out_rotor(const std::vector<Recording>& records, double share, const Identify& identify);
identification::HeldOut hold_out_general(const std::vector<Recording>& records, double share, const Identify& identify);
/// Scores of a model on data not used for it; `what` describes them.
identification::HeldOut predict_held_out(const IdentifiedModel& model, const Recording& test, std::string what,
                                         bool rotor, const identification::ValidateOptions& options = {});

/// Lines for a person: chi-square, condition number, collinear groups, held-out error.
std::string describe(const Evidence& evidence, const Summary& summary);
io::Json to_json(const Evidence& evidence);
/// "0.0221" or "diverges".
std::string show_error(double value);

}  // namespace whirl::app
