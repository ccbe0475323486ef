#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "whirl/core/summary.hpp"

namespace whirl::io {

/// Version, SHA-256 of the input files and the options of a result. File names without their folders, so that the same
/// study gives the same files anywhere.
Provenance provenance(const std::vector<std::filesystem::path>& inputs, std::string options,
                      unsigned long long seed = 0);

}  // namespace whirl::io
