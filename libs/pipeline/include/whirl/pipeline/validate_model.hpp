#pragma once
#include "whirl/io/json.hpp"
#include "whirl/sindy/validate.hpp"

namespace whirl {

/// One entry of validation.json (`runs[]`): file, rmse_x, rmse_y (m), nrmse, clean_rmse_*, noise_*, peaks, status.
Json to_json(const Validation& validation, const std::string& file);

}  // namespace whirl
