#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/expr/library.hpp"

namespace whirl::io {

/// Candidate library from a TOML file; the keys are listed in docs/formats.md under library.toml.
///
/// Terms of `common` and `[terms]` become one group each and equation (no tie), after the `[[group]]` tables. `lhs`:
/// the equations sought by the caller, for a file that names none; a file that names its own keeps them. Throws Error
/// with file, line and reason: unknown keys, terms that cannot be read, lists that do not fit the equations, no term at
/// all.
expr::CandidateLibrary read_library(const std::filesystem::path& path, const std::vector<std::string>& lhs = {});
/// From text; `name` stands in messages.
expr::CandidateLibrary parse_library_toml(std::string_view text, std::string_view name,
                                          const std::vector<std::string>& lhs = {});
/// TOML text that the functions above read back to an equal library; `comment` lines stand on top.
std::string to_toml(const expr::CandidateLibrary& library, const std::vector<std::string>& comment = {});

}  // namespace whirl::io
