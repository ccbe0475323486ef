#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "whirl/rig/parameters.hpp"

namespace whirl::rig {

/// Virtual rig from a TOML file: the keys of `rig_toml()`, each optional; what is not named keeps its default, and a
/// key may use another unit of the same quantity (`radius_m` for `radius_mm`). An empty path gives the default rig.
/// Errors: those of read_settings, unknown keys, fields out of range.
RigParameters read_rig(const std::filesystem::path& path);

/// The structural modes that a data sheet names ([modes.N] of the same file), as a designer knows them: frequency_hz is
/// needed; what is not named is not taken from the virtual rig: damping 1 %, participation 0.02, sensor_sign 0 (not
/// known). Throws Error as read_rig does, and for a mode without frequency or with a participation below 0.
std::vector<RigMode> read_modes(const std::filesystem::path& path);

/// The parameters as a TOML file that read_rig reads back.
std::string rig_toml(const RigParameters& parameters);

}  // namespace whirl::rig
