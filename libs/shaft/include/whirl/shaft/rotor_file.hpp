#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

/// Rotor from TOML; docs/rotor.md lists the keys. Throws Error with file, line, key, value and what is allowed.
Rotor read_rotor(const std::filesystem::path& file);
/// From text; `name` stands in messages.
Rotor parse_rotor(std::string_view text, std::string_view name);

/// Names of the rotors to begin with: jeffcott, two-disc, overhung, centrifuge, kit.
std::vector<std::string> rotor_templates();
/// TOML text of one of them, with comments. Throws Error for another name.
std::string rotor_template(std::string_view name);

}  // namespace whirl::shaft
