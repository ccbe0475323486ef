#pragma once
#include <optional>
#include <string>

#include "whirl/core/modal_model.hpp"

namespace whirl::app {

/// Frequency responses from the JSON of `whirl frf`, a universal file (dataset 58, type 4) or, with `kind` stated, a
/// CSV table. Nothing when the file holds something else.
std::optional<FrequencyResponse> read_responses(const std::string& file, const std::string& kind);

/// The kind named "receptance", "mobility" or "accelerance".
FrfKind frf_kind(const std::string& name);

}  // namespace whirl::app
