#pragma once
#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/io/json.hpp"
#include "whirl/sindy/validate.hpp"

namespace whirl {

/// Free run of any identified model against a record that it was not fitted to.
///
/// A model with `rotor` goes to `validate`. A library model in rotor states (method "paper") runs on its equations along the
/// measured angle, from the initial state that least squares of {1, cos beta, sin beta} on the first 0.1 s gives; its
/// unbalance is always the identified one. A run that leaves 1000 times the record's amplitude has diverged: status
/// unusable, rmse infinite. Throws Error for a model with no lateral equations.
Validation validate_model(const IdentifiedModel& model, const Recording& recording, const ValidateOptions& options = {});

/// One entry of validation.json (`runs[]`): file, rmse_x, rmse_y (m), nrmse, clean_rmse_*, noise_*, peaks, status.
Json to_json(const Validation& validation, const std::string& file);

}  // namespace whirl
