#pragma once
#include <string>
#include <vector>

#include "command_texts.hpp"

namespace whirl::app {

/// The words of a command line with the defaults of a folder: the file `whirl.toml` in the current folder, or the one
/// that WHIRL_CONFIG names (empty: none). A table is a subcommand ([identify], [rig.record]), a key one of its flags,
/// with - or _. Flags that `words` has already are left as they are. Says on stderr what was taken, unless --quiet is
/// among the words. \throws Error for a file that is no TOML, and for a subcommand, flag or value that does not exist,
/// with file and line.
std::vector<std::string> with_defaults(const CommandText& program, std::vector<std::string> words);

}  // namespace whirl::app
