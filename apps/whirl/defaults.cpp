#include "defaults.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "command_texts.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/tell.hpp"
#include "whirl/io/units.hpp"

namespace whirl::app {
namespace {

const CommandText* child_of(const CommandText& command, std::string_view word) {
  for (const CommandText& child : command.children) {
    if (last_word(child.name) == word) return &child;
  }
  return nullptr;
}

const OptionText* flag_of(const CommandText& command, const std::string& flag) {
  for (const OptionText& option : command.options) {
    if (!option.positional && std::find(option.flags.begin(), option.flags.end(), flag) != option.flags.end())
      return &option;
  }
  return nullptr;
}

class Reader {
 public:
  explicit Reader(std::filesystem::path file) : file_(std::move(file)) {}

  [[noreturn]] void refuse(const toml::node& node, const std::string& what) const {
    throw Error(fmt::format("{}:{}: {}", file_.string(), node.source().begin.line, what));
  }

  std::string scalar(const toml::node& node, const std::string& flag) const {
    if (const auto* text = node.as_string()) return text->get();
    if (const auto* number = node.as_integer()) return fmt::format("{}", number->get());
    if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
    refuse(node, flag + " must be text, a number, true or false, or a list of these");
  }

  /// The words of one key; none for false.
  std::vector<std::string> words(const toml::node& node, const std::string& flag, const OptionText& option) const {
    if (option.argument.empty()) {
      if (!node.is_boolean()) refuse(node, flag + " is a switch: true or false");
      return node.as_boolean()->get() ? std::vector<std::string>{flag} : std::vector<std::string>{};
    }
    if (!node.is_array()) return {flag + "=" + scalar(node, flag)};
    if (!option.several) refuse(node, flag + " takes one value");
    std::vector<std::string> words;
    for (const toml::node& one : *node.as_array()) words.push_back(flag + "=" + scalar(one, flag));
    return words;
  }

  /// Checks every table and key, and collects those of `place`.
  void visit(const toml::table& table, const CommandText& command, const CommandText& place,
             std::vector<std::pair<std::string, std::vector<std::string>>>& taken) const {
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      if (const CommandText* child = child_of(command, name); child != nullptr && node.is_table()) {
        visit(*node.as_table(), *child, place, taken);
        continue;
      }
      std::string flag = "--" + name;
      std::replace(flag.begin(), flag.end(), '_', '-');
      const OptionText* option = flag_of(command, flag);
      if (option == nullptr || node.is_table()) {
        std::vector<std::string> known;
        for (const CommandText& child : command.children) known.push_back(last_word(child.name));
        for (const OptionText& o : command.options) {
          if (!o.positional && o.flags.back().starts_with("--")) known.push_back(o.flags.back().substr(2));
        }
        const std::string near = io::nearest(flag.substr(2), known);
        refuse(node, fmt::format("{} has no {} '{}'{}", command.name, node.is_table() ? "subcommand" : "flag", name,
                                 near.empty() ? "" : ", did you mean '" + near + "'?"));
      }
      if (const auto found = words(node, flag, *option); &command == &place) taken.emplace_back(flag, found);
    }
  }

 private:
  std::filesystem::path file_;
};

}  // namespace

std::optional<std::filesystem::path> defaults_file() {
  const char* named = std::getenv("WHIRL_CONFIG");
  const std::filesystem::path file = named != nullptr ? named : "whirl.toml";
  if (std::error_code ec; file.empty() || (named == nullptr && !std::filesystem::is_regular_file(file, ec))) return {};
  return file;
}

std::vector<std::string> with_defaults(const CommandLine& app, std::vector<std::string> words) {
  const auto given = defaults_file();
  if (!given) return words;
  const std::filesystem::path& file = *given;
  const auto has = [&](std::string_view word) { return std::find(words.begin(), words.end(), word) != words.end(); };
  if (words.empty() || words.front() == "help" || has("-h") || has("--help") || has("--help-all") || has("--version"))
    return words;

  const CommandText program = app.describe();
  const CommandText* place = &program;
  std::size_t at = 0;
  for (; at < words.size(); ++at) {
    const CommandText* child = child_of(*place, words[at]);
    if (child == nullptr) break;
    place = child;
  }
  std::vector<std::pair<std::string, std::vector<std::string>>> taken;
  try {
    Reader(file).visit(toml::parse_file(file.string()), program, *place, taken);
  } catch (const toml::parse_error& e) {
    throw Error(fmt::format("{}:{}: {}", file.string(), e.source().begin.line, e.description()));
  }
  std::string said;
  for (const auto& [flag, own] : taken) {
    const bool said_already = std::any_of(words.begin(), words.end(), [&f = flag](const std::string& word) {
      return word == f || word.starts_with(f + "=");
    });
    if (said_already || own.empty()) continue;
    words.insert(words.begin() + static_cast<std::ptrdiff_t>(at), own.begin(), own.end());
    said += fmt::format(" {}", fmt::join(own, " "));
  }
  if (!said.empty() && !has("--quiet")) tell("whirl: from {}:{}\n", file.string(), said);
  return words;
}

}  // namespace whirl::app
