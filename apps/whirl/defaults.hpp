#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"

namespace whirl::app {

/// The file of defaults: `whirl.toml` in the current folder, or the one that WHIRL_CONFIG names (empty: none).
std::optional<std::filesystem::path> defaults_file();

/// The words of a command line with the defaults of that file. A table is a subcommand ([identify], [rig.record]), a
/// key one of its flags, with - or _. Flags that `words` has already are left as they are. Says on stderr what was
/// taken, unless --quiet is among the words. \throws Error for a file that is no TOML, and for a subcommand, flag or
/// value that does not exist, with file and line.
std::vector<std::string> with_defaults(const CommandLine& app, std::vector<std::string> words);

}  // namespace whirl::app
