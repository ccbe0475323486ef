#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/lagrange/derive.hpp"

namespace whirl::lagrange {

/// A mechanical system as a file describes it.
struct LagrangeFile {
  std::string title;
  LagrangeProblem problem;
  std::vector<std::string> report;  ///< terms in the parameters to be stated after a fit, e.g. "m*e"
};

/// Reads a TOML file; the keys are listed in docs/formats.md under system.toml. Throws Error with file, line and
/// reason.
LagrangeFile read_lagrange_file(const std::filesystem::path& path);
/// From text; `name` stands in messages.
LagrangeFile parse_lagrange_file(std::string_view text, std::string_view name);

}  // namespace whirl::lagrange
