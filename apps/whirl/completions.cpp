// Shell completions from the description of the program.
#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "command_texts.hpp"
#include "whirl/core/error.hpp"

namespace whirl::app {
namespace {

/// Every command, the program first, with its place: the words after "whirl".
void each(const CommandText& command, const std::string& place,
          const std::function<void(const CommandText&, const std::string&)>& visit) {
  visit(command, place);
  for (const CommandText& child : command.children) {
    const std::string word = last_word(child.name);
    each(child, place.empty() ? word : place + " " + word, visit);
  }
}

std::string places(const CommandText& program) {
  std::string list;
  each(program, "", [&](const CommandText&, const std::string& place) {
    if (!place.empty()) list += fmt::format("{}'{}'", list.empty() ? "" : "|", place);
  });
  return list;
}

std::vector<std::string> flags_of(const CommandText& command) {
  std::vector<std::string> flags;
  for (const OptionText& o : command.options) {
    if (!o.positional) flags.insert(flags.end(), o.flags.begin(), o.flags.end());
  }
  return flags;
}

/// Inside single quotes of a shell.
std::string shell_quoted(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else {
      out += c == '\n' ? ' ' : c;
    }
  }
  return out;
}

std::string bash(const CommandText& program) {
  std::string flags, words, values;
  each(program, "", [&](const CommandText& command, const std::string& place) {
    flags += fmt::format("    '{}') flags='{}' ;;\n", place, fmt::join(flags_of(command), " "));
    std::vector<std::string> children;
    for (const CommandText& child : command.children) children.push_back(last_word(child.name));
    if (!children.empty()) words += fmt::format("    '{}') words='{}' ;;\n", place, fmt::join(children, " "));
    for (const OptionText& o : command.options) {
      if (o.choices.empty() || o.positional) continue;
      for (const std::string& flag : o.flags)
        values += fmt::format("    '{} {}') values='{}' ;;\n", place, flag,
                              shell_quoted(fmt::format("{}", fmt::join(o.choices, " "))));
    }
  });
  return fmt::format(R"(# bash completion for whirl, written by `whirl completion bash`
_whirl() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} place='' next i flags='' words='' values=''
  for ((i = 1; i < COMP_CWORD; ++i)); do
    next="${{place:+$place }}${{COMP_WORDS[i]}}"
    case "$next" in
    {}) place=$next ;;
    *) break ;;
    esac
  done
  case "$place" in
{}  esac
  case "$place" in
{}  esac
  case "$place ${{COMP_WORDS[COMP_CWORD-1]}}" in
{}  esac
  COMPREPLY=()
  if [[ -n $values ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$values" -- "$word")
  elif [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$flags" -- "$word")
  elif [[ -n $words ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
  fi # otherwise files
}}
complete -o default -F _whirl whirl
)",
                     places(program), flags, words, values);
}

/// "name:what it is" for _describe.
std::string described(const std::string& name, const std::string& text) {
  std::string colons;
  for (const char c : name) colons += c == ':' ? std::string("\\:") : std::string(1, c);
  return fmt::format("'{}:{}'", shell_quoted(colons), shell_quoted(text));
}

std::string zsh(const CommandText& program) {
  std::string cases, values;
  each(program, "", [&](const CommandText& command, const std::string& place) {
    cases += fmt::format("  '{}')\n    flags=(", place);
    for (const OptionText& o : command.options) {
      if (o.positional) continue;
      for (const std::string& flag : o.flags) cases += "\n      " + described(flag, o.help);
      if (o.choices.empty()) continue;
      for (const std::string& flag : o.flags)
        values += fmt::format("  '{} {}') compadd -- {}; return ;;\n", place, flag, fmt::join(o.choices, " "));
    }
    cases += ")\n";
    if (!command.children.empty()) {
      cases += "    subcommands=(";
      for (const CommandText& child : command.children)
        cases += "\n      " + described(last_word(child.name), child.summary);
      cases += ")\n";
    }
    cases += "    ;;\n";
  });
  return fmt::format(R"(#compdef whirl
# zsh completion for whirl, written by `whirl completion zsh`
_whirl() {{
  local place='' next i
  local -a flags subcommands
  for ((i = 2; i < CURRENT; ++i)); do
    next="${{place:+$place }}${{words[i]}}"
    case "$next" in
    {}) place=$next ;;
    *) break ;;
    esac
  done
  case "$place ${{words[CURRENT-1]}}" in
{}  esac
  case "$place" in
{}  esac
  if [[ ${{words[CURRENT]}} == -* ]]; then
    _describe flag flags
  elif (( ${{#subcommands}} )); then
    _describe subcommand subcommands
  else
    _files
  fi
}}
_whirl "$@"
)",
                     places(program), values, cases);
}

std::string fish(const CommandText& program) {
  std::string out = R"(# fish completion for whirl, written by `whirl completion fish`
function __whirl_at
    set -l words (commandline -opc)
    set -l depth (count $argv)
    test (count $words) -gt $depth; or return 1
    test $depth -eq 0; or test "$words[2..(math $depth + 1)]" = "$argv"
end
function __whirl_choosing
    __whirl_at $argv; and test (count (commandline -opc)) -eq (math (count $argv) + 1)
end
)";
  each(program, "", [&](const CommandText& command, const std::string& place) {
    for (const CommandText& child : command.children)
      out += fmt::format("complete -c whirl -n '__whirl_choosing {}' -f -a {} -d '{}'\n", place, last_word(child.name),
                         shell_quoted(child.summary));
    for (const OptionText& o : command.options) {
      if (o.positional) continue;
      std::string names;
      for (const std::string& flag : o.flags)
        names += flag.starts_with("--") ? " -l " + flag.substr(2) : " -s " + flag.substr(1);
      const std::string values = o.choices.empty() ? "" : fmt::format(" -f -a '{}'", fmt::join(o.choices, " "));
      out += fmt::format("complete -c whirl -n '__whirl_at {}'{}{}{} -d '{}'\n", place, names,
                         o.argument.empty() ? "" : " -r", values, shell_quoted(o.help));
    }
  });
  return out;
}

}  // namespace

std::string completion(const CommandText& program, const std::string& shell) {
  if (shell == "bash") return bash(program);
  if (shell == "zsh") return zsh(program);
  if (shell == "fish") return fish(program);
  throw Error::in_field("SHELL", shell, "bash, zsh or fish");
}

}  // namespace whirl::app
