#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "whirl/identify/identify.hpp"
#include "whirl/io/json.hpp"

namespace whirl::identification {

/// whirl.model/1 with its member `evidence` (docs/formats.md).
io::Json to_json(const Identification& identification);
io::Json to_json(const Evidence& evidence);
io::Json to_json(const HeldOut& held_out);
/// `evidence.range` of a model.json; empty where the file has none.
std::optional<DataRange> load_data_range(const std::filesystem::path& model);
/// Largest part of the held-out motion, relative to its rms, that free runs of the model in a model.json leave; NaN
/// where the file does not say.
double load_left_unexplained(const std::filesystem::path& model);
/// One entry of validation.json (`runs[]`): file, rmse_x, rmse_y (m), nrmse, clean_rmse_*, noise_*, peaks, status.
io::Json to_json(const Validation& validation, const std::string& file);
/// Document of `whirl validate`, whirl.validation/1.
io::Json to_json(const ValidationReport& report);
/// Document of `whirl identify --compare`, whirl.method_comparison/1.
io::Json to_json(const MethodComparison& comparison);

}  // namespace whirl::identification
