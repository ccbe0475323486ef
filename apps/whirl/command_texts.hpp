#pragma once
#include <string>
#include <vector>

namespace whirl::app {

/// One flag or positional argument as --help describes it.
struct OptionText {
  std::vector<std::string> flags;  ///< "-h", "--help"; a positional argument has its name only
  std::string argument;            ///< what follows the flag, e.g. "FLOAT"; empty for a switch
  std::string help;
  std::string heading;  ///< under which --help lists it
  std::vector<std::string> choices;
  bool positional = false;
  bool required = false;
  bool several = false;  ///< takes more than one value
  bool file = false;     ///< names a file or folder
};

/// A command with everything that --help-all says of it. The one source of manual pages, completions and the reference.
struct CommandText {
  std::string name;  ///< "whirl rig record"
  std::string summary;
  std::string details;
  std::vector<OptionText> options;
  std::vector<CommandText> children;
};

/// The command without those it stands below: "record" of "whirl rig record".
inline std::string last_word(const std::string& name) { return name.substr(name.rfind(' ') + 1); }

/// Page of section 1 in the language of man(7); the file is named as `page_name` says, with ".1".
std::string manual_page(const CommandText& command, const std::string& version);
/// Section of a reference in Markdown.
std::string markdown_page(const CommandText& command);
/// "whirl-rig-record".
std::string page_name(const CommandText& command);

/// Completion of subcommands, flags and the values that a flag allows. `shell`: bash, zsh or fish.
/// \throws Error for another shell.
std::string completion(const CommandText& program, const std::string& shell);

}  // namespace whirl::app
