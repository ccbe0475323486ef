#pragma once
#include "whirl/identify/validate.hpp"
#include "whirl/io/json.hpp"

namespace whirl::identification {

/// One entry of validation.json (`runs[]`): file, rmse_x, rmse_y (m), nrmse, clean_rmse_*, noise_*, peaks, status.
io::Json to_json(const Validation& validation, const std::string& file);

}  // namespace whirl::identification
