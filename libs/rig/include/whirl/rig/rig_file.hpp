#pragma once
#include <filesystem>
#include <string>

#include "whirl/rig/parameters.hpp"

namespace whirl::rig {

/// Virtual rig from a TOML file: the keys of `rig_toml()`, each optional; what is not named keeps its default, and a
/// key may use another unit of the same quantity (`radius_m` for `radius_mm`). An empty path gives the default rig.
/// Errors: those of read_settings, unknown keys, fields out of range.
RigParameters read_rig(const std::filesystem::path& path);

/// The parameters as a TOML file that read_rig reads back.
std::string rig_toml(const RigParameters& parameters);

}  // namespace whirl::rig
