#include "command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>

#include "command_texts.hpp"
#include "usage.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/outputs.hpp"
#include "whirl/io/units.hpp"

namespace whirl::app {

struct Option::State {
  CLI::Option* option = nullptr;
  std::optional<FileRole> role;
  std::string kind;
  bool expert = false;
  std::string group;
  std::vector<std::string> choices;
  std::vector<std::string> needed;  // one of them
};

Option::Option(std::unique_ptr<State> state) : state_(std::move(state)) {}
Option::~Option() = default;

Option* Option::required() {
  state_->option->required();
  return this;
}
Option* Option::one_of(const std::vector<std::string>& values) {
  state_->choices = values;
  state_->option->check(member(values));
  return this;
}
Option* Option::one_of_numbers(const std::vector<int>& values) {
  for (const int value : values) state_->choices.push_back(fmt::to_string(value));
  state_->option->check(member(state_->choices));
  return this;
}
Option* Option::range(double low, double high) {
  state_->option->check(between(low, high));
  if (const auto& names = state_->option->get_lnames(); !names.empty() && names.back().ends_with("-deg"))
    state_->option->check(degrees());
  return this;
}
Option* Option::positive() {
  state_->option->check(positive_number());
  return this;
}
Option* Option::show_default() {
  state_->option->capture_default_str();
  return this;
}
Option* Option::group(const std::string& heading) {
  state_->group = heading;
  state_->option->group(heading);
  return this;
}
Option* Option::expert() {
  state_->expert = true;
  if (state_->group.empty()) state_->option->group("Expert");
  return this;
}
Option* Option::delimiter(char character) {
  state_->option->delimiter(character);
  return this;
}
Option* Option::one_value() {
  state_->option->allow_extra_args(false);
  return this;
}
Option* Option::excludes(const std::string& flag) {
  state_->option->excludes(flag);
  return this;
}
Option* Option::excludes(const Option* other) {
  state_->option->excludes(other->state_->option);
  return this;
}
Option* Option::existing_file() {
  state_->option->check(file_that_exists());
  return this;
}
Option* Option::needs(const std::string& flag, const std::string& or_flag) {
  state_->needed = {flag};
  if (!or_flag.empty()) state_->needed.push_back(or_flag);
  return this;
}
Option* Option::input() {
  state_->role = FileRole::input;
  return this;
}
Option* Option::output(const std::string& kind) {
  state_->role = FileRole::output;
  state_->kind = kind;
  return this;
}
Option* Option::output_folder() {
  state_->role = FileRole::output_folder;
  return this;
}
Option* Option::output_prefix() {
  state_->role = FileRole::output_prefix;
  return this;
}

namespace {
/// Groups of commands one under the other, without blank lines: the list stands on one screen.
class GroupedCommands : public CLI::Formatter {
  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode) const override {
    std::string out, group;
    for (const CLI::App* sub : app->get_subcommands([](const CLI::App*) { return true; })) {
      if (sub->get_group().empty()) continue;
      if (sub->get_group() != group) {
        group = sub->get_group();
        out += (out.empty() ? "\n" : "") + group + ":\n";
      }
      out += make_subcommand(sub);
    }
    return out;
  }
};
}  // namespace

struct CommandLine::State {
  CLI::App* app = nullptr;
  std::unique_ptr<CLI::App> owned;  // of the program
  std::deque<std::unique_ptr<Option>> options;
  std::deque<std::unique_ptr<CommandLine>> children;
  bool force = false;
  struct {
    std::string heading, needs;
    bool expert = false;
  } section;

  Option* keep(CLI::Option* option) {
    auto state = std::make_unique<Option::State>();
    state->option = option;
    options.push_back(std::unique_ptr<Option>(new Option(std::move(state))));
    Option* kept = options.back().get();
    if (!section.heading.empty()) kept->group(section.heading);
    if (!section.needs.empty()) kept->needs(section.needs);
    if (section.expert) kept->expert();
    return kept;
  }

  std::vector<std::filesystem::path> inputs() const {
    std::vector<std::filesystem::path> paths;
    for (const auto& o : options) {
      if (o->state_->role != FileRole::input) continue;
      for (const std::string& value : o->state_->option->results()) paths.emplace_back(value);
    }
    return paths;
  }

  /// Given on the command line, and those that have a default.
  std::vector<io::PlannedOutput> outputs() const {
    std::vector<io::PlannedOutput> planned;
    for (const auto& o : options) {
      const auto& role = o->state_->role;
      if (!role || role == FileRole::input || role == FileRole::output_prefix) continue;
      std::vector<std::string> values = o->state_->option->results();
      if (values.empty() && !o->state_->option->get_default_str().empty())
        values.push_back(o->state_->option->get_default_str());
      for (std::string value : values) {
        if (value.size() > 1 && value.front() == '"') value = value.substr(1, value.size() - 2);  // a path's default
        if (value.empty()) continue;
        planned.push_back({o->state_->option->get_name(), value, o->state_->kind, role == FileRole::output_folder});
      }
    }
    return planned;
  }

  /// A flag without its partner, a file without a name: each would do nothing.
  void check_given() const {
    for (const auto& o : options) {
      const std::vector<std::string> values = o->state_->option->results();
      if (o->state_->role && std::find(values.begin(), values.end(), "") != values.end())
        throw Error::in_field(o->state_->option->get_name(), "''", "the name of a file or folder");
      if (o->state_->role == FileRole::input && o->state_->option->get_positional()) {
        for (auto a = values.begin(); a != values.end(); ++a)
          for (auto b = values.begin(); b != a; ++b)
            if (io::same_file(*a, *b)) throw Error(fmt::format("{}: given twice{}", *a, *a == *b ? "" : ", as " + *b));
      }
      const std::vector<std::string>& needed = o->state_->needed;
      const auto given = [&](const std::string& flag) { return app->get_option(flag)->count() > 0; };
      if (needed.empty() || o->state_->option->count() == 0 || std::any_of(needed.begin(), needed.end(), given))
        continue;
      throw Error(
          fmt::format("{} is for {}: give both, or none", o->state_->option->get_name(), fmt::join(needed, " or ")));
    }
  }

  /// From --help; an option in no group has no name in messages either, so only when help is printed.
  void hide_experts() {
    for (const auto& o : options) {
      if (o->state_->expert) o->state_->option->group("");
    }
  }

  /// Gives every command with outputs its --force, and every command with hidden flags its --help-all.
  void complete() {
    const auto writes = [](const auto& o) { return o->state_->role && o->state_->role != FileRole::input; };
    const auto hidden = [](const auto& o) { return o->state_->expert; };
    if (std::any_of(options.begin(), options.end(), writes))
      app->add_flag("--force", force, "replace an existing output of another kind");
    if (std::any_of(options.begin(), options.end(), hidden))
      app->set_help_all_flag("--help-all", "all flags, those of the expert too");
    for (const auto& child : children) child->state_->complete();
  }

  /// The subcommand that was given, as deep as it goes.
  CommandLine* given(CommandLine* self) {
    for (const auto& child : children) {
      if (child->state_->app->parsed()) return child->state_->given(child.get());
    }
    return self;
  }
};

CommandLine::CommandLine(const std::string& description, const std::string& version)
    : state_(std::make_unique<State>()) {
  state_->owned = std::make_unique<CLI::App>(description);
  state_->app = state_->owned.get();
  state_->app->name("whirl");
  state_->app->set_version_flag("--version", version);
  state_->app->formatter(std::make_shared<GroupedCommands>());
  state_->app->get_formatter()->column_width(34);
}
CommandLine::CommandLine(std::unique_ptr<State> state) : state_(std::move(state)) {}
CommandLine::~CommandLine() = default;

CommandLine* CommandLine::add_subcommand(const std::string& name, const std::string& summary) {
  auto state = std::make_unique<State>();
  state->app = state_->app->add_subcommand(name, summary);
  if (!state_->section.heading.empty()) state->app->group(state_->section.heading);
  state_->children.push_back(std::unique_ptr<CommandLine>(new CommandLine(std::move(state))));
  return state_->children.back().get();
}

template <class T>
Option* CommandLine::add_option(const std::string& name, T& value, const std::string& help) {
  CLI::Option* option = state_->app->add_option(name, value, help);
  check_number<T>(*option);
  return state_->keep(option);
}
template Option* CommandLine::add_option(const std::string&, double&, const std::string&);
template Option* CommandLine::add_option(const std::string&, std::optional<double>&, const std::string&);
template Option* CommandLine::add_option(const std::string&, int&, const std::string&);
template Option* CommandLine::add_option(const std::string&, unsigned&, const std::string&);
template Option* CommandLine::add_option(const std::string&, long&, const std::string&);
template Option* CommandLine::add_option(const std::string&, std::uint64_t&, const std::string&);
template Option* CommandLine::add_option(const std::string&, std::string&, const std::string&);
template Option* CommandLine::add_option(const std::string&, std::filesystem::path&, const std::string&);
template Option* CommandLine::add_option(const std::string&, std::vector<double>&, const std::string&);
template Option* CommandLine::add_option(const std::string&, std::vector<int>&, const std::string&);
template Option* CommandLine::add_option(const std::string&, std::vector<std::string>&, const std::string&);
template Option* CommandLine::add_option(const std::string&, std::vector<std::filesystem::path>&, const std::string&);

Option* CommandLine::add_flag(const std::string& name, bool& value, const std::string& help) {
  return state_->keep(state_->app->add_flag(name, value, help));
}

CommandLine* CommandLine::section(const std::string& heading, const std::string& needs, bool expert) {
  state_->section = {heading, needs, expert};
  return this;
}
CommandLine* CommandLine::footer(const std::string& text) {
  state_->app->footer(text);
  return this;
}
CommandLine* CommandLine::callback(std::function<void()> run) {
  state_->app->callback([this, run = std::move(run)] {
    io::check_outputs(state_->inputs(), state_->outputs(), state_->force);
    state_->check_given();
    run();
  });
  return this;
}
CommandLine* CommandLine::require_subcommand() {
  state_->app->require_subcommand(1);
  return this;
}
std::vector<std::string> CommandLine::given_flags() const {
  std::vector<std::string> flags;
  for (const auto& o : state_->options) {
    const CLI::Option& option = *o->state_->option;
    if (!option.get_positional() && option.count() > 0) flags.push_back("--" + option.get_lnames().back());
  }
  return flags;
}
void CommandLine::check_output(const std::filesystem::path& path, const std::string& kind) const {
  if (std::error_code ec; !std::filesystem::exists(path.parent_path().empty() ? "." : path.parent_path(), ec)) return;
  io::check_outputs(state_->inputs(), {{"output", path, kind, false}}, state_->force);
}

namespace {

OptionText text_of(const CLI::Option& option) {
  OptionText text;
  text.positional = option.get_positional();
  if (text.positional) {
    text.flags.push_back(option.get_name());
  } else {
    for (const std::string& name : option.get_snames()) text.flags.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) text.flags.push_back("--" + name);
  }
  text.argument = option.get_type_name();
  text.argument = text.argument.substr(0, text.argument.find(':'));
  text.help = option.get_description();
  if (const std::string preset = option.get_default_str(); !preset.empty())
    text.help += fmt::format("{}default {}", text.help.empty() ? "" : "; ", preset);
  text.heading = option.get_group();
  text.required = option.get_required();
  text.several = option.get_items_expected_max() > 1;
  return text;
}

/// The first argument that looks like a flag and is none.
std::optional<std::string> unknown_flag(const CLI::App& app) {
  for (const std::string& word : app.remaining(true)) {
    const bool number = word.size() > 1 && (std::isdigit(static_cast<unsigned char>(word[1])) != 0 || word[1] == '.');
    if (word.size() > 1 && word[0] == '-' && !number) return word.substr(0, word.find('='));
  }
  return std::nullopt;
}

std::vector<std::string> flags_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* o : app.get_options()) {
    for (const std::string& name : o->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

}  // namespace

CommandText CommandLine::describe() const {
  const CLI::App& app = *state_->app;
  CommandText text;
  text.name = app.get_name();
  for (const CLI::App* up = app.get_parent(); up != nullptr; up = up->get_parent())
    text.name = up->get_name() + " " + text.name;
  text.summary = app.get_description();
  while (!text.summary.empty() && (text.summary.back() == '\n' || text.summary.back() == '.')) text.summary.pop_back();
  std::replace(text.summary.begin(), text.summary.end(), '\n', ' ');
  if (text.summary.starts_with("whirl: ")) text.summary = text.summary.substr(7);
  text.details = app.get_footer();
  for (const CLI::Option* option : app.get_options()) {
    text.options.push_back(text_of(*option));
    for (const auto& own : state_->options) {
      if (own->state_->option != option) continue;
      text.options.back().choices = own->state_->choices;
      text.options.back().file = own->state_->role.has_value();
      if (own->state_->expert) text.options.back().heading = own->state_->group.empty() ? "Expert" : own->state_->group;
    }
  }
  for (const auto& child : state_->children) text.children.push_back(child->describe());
  return text;
}

int CommandLine::parse(int argc, char** argv) {
  state_->complete();
  CLI::App& app = *state_->app;
  std::vector<std::string> words(argv + 1, argv + argc);
  const auto subcommands = [](const CLI::App& of) {
    std::vector<std::string> names;
    for (const CLI::App* sub : of.get_subcommands([](const CLI::App*) { return true; }))
      names.push_back(sub->get_name());
    return names;
  };
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    CLI::App* of = &app;
    for (const std::string& word : words) {
      const std::vector<std::string> names = subcommands(*of);
      if (word.starts_with("-") || names.empty()) break;
      if (std::find(names.begin(), names.end(), word) == names.end())
        return say_unknown("subcommand", word, names, *of);
      of = of->get_subcommand(word);
    }
    words.push_back("--help");
  }
  std::reverse(words.begin(), words.end());  // as CLI11 takes them
  const auto deepest = [&]() -> CLI::App& { return *state_->given(this)->state_->app; };
  try {
    app.parse(std::move(words));
  } catch (const CLI::CallForAllHelp&) {
    return app.exit(CLI::CallForHelp());
  } catch (const CLI::RequiredError& e) {
    const CLI::App& at = deepest();
    const std::vector<std::string> extra = at.remaining(true);
    if (!subcommands(at).empty() && !extra.empty() && !extra.front().starts_with("-"))
      return say_unknown("subcommand", extra.front(), subcommands(at), at);
    if (const auto flag = unknown_flag(at)) return say_unknown("flag", *flag, flags_of(at), at);
    return say_misused(e, at);
  } catch (const CLI::ExtrasError& e) {
    const CLI::App& at = deepest();
    if (const auto flag = unknown_flag(at)) return say_unknown("flag", *flag, flags_of(at), at);
    return say_misused(e, at);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() != 0) return say_misused(e, deepest());
    state_->given(this)->state_->hide_experts();
    return app.exit(e);
  }
  return 0;
}

}  // namespace whirl::app
