#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace whirl::app {

struct CommandText;

/// What a path on the command line is for. The program refuses, before it computes anything, to write over a file that
/// it reads, to a place that cannot be written, and (without --force) over an existing file of another kind.
enum class FileRole { input, output, output_folder, output_prefix };

/// One flag or positional argument. Every call returns the option itself, so that calls follow each other.
class Option {
 public:
  Option* required();
  /// The value must be one of these.
  Option* one_of(const std::vector<std::string>& values);
  Option* one_of_numbers(const std::vector<int>& values);
  /// Number in [low, high].
  Option* range(double low, double high);
  Option* positive();
  /// Prints the value that the variable has now as the default.
  Option* show_default();
  /// Heading under which --help lists it.
  Option* group(const std::string& heading);
  /// Left out of --help, listed by --help-all.
  Option* expert();
  /// Several values in one argument, apart by this character.
  Option* delimiter(char character);
  /// One value per mention of the flag; the flag may be repeated.
  Option* one_value();
  Option* excludes(const std::string& flag);
  Option* excludes(const Option* other);
  Option* existing_file();
  /// Given without this other flag (or the second one) it does nothing, and is refused.
  Option* needs(const std::string& flag, const std::string& or_flag = "");
  /// The value is a file to read.
  Option* input();
  /// The value is a file to write: `kind` as `io::file_kind` names it, a schema such as "whirl.model" or a word such as
  /// "record"; empty: by the ending.
  Option* output(const std::string& kind = "");
  /// The value is a folder to write files into.
  Option* output_folder();
  /// The first part of the names of several files: the command checks each with `CommandLine::check_output`.
  Option* output_prefix();

 private:
  friend class CommandLine;
  struct State;
  explicit Option(std::unique_ptr<State> state);

 public:
  ~Option();

 private:
  std::unique_ptr<State> state_;
};

/// A program or subcommand with its flags. The only door to CLI11: its header is compiled in command_line.cpp and
/// usage.cpp alone.
class CommandLine {
 public:
  /// The program.
  CommandLine(const std::string& description, const std::string& version);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  CommandLine* add_subcommand(const std::string& name, const std::string& summary);
  /// T: double (optional too), int, unsigned, long, std::uint64_t, std::string, std::filesystem::path, and vectors of
  /// double, int, std::string or path. A name without a dash is a positional argument.
  template <class T>
  Option* add_option(const std::string& name, T& value, const std::string& help);
  Option* add_flag(const std::string& name, bool& value, const std::string& help);
  /// What is added from here on, flags and subcommands, stands under `heading`, is refused without the flag `needs`
  /// where that is named, and is left out of --help for the `expert`. Without arguments: no longer.
  CommandLine* section(const std::string& heading = "", const std::string& needs = "", bool expert = false);
  CommandLine* footer(const std::string& text);
  /// Called when this subcommand was given and its files have been checked.
  CommandLine* callback(std::function<void()> run);
  CommandLine* require_subcommand();

  /// The flags that were given, by their last name.
  std::vector<std::string> given_flags() const;

  /// Refuses `path` as an output like one that was given on the command line; for names that a command makes itself, in
  /// a folder that may not be there yet.
  void check_output(const std::filesystem::path& path, const std::string& kind = "") const;

  /// Everything that --help-all says, of this command and of those below it. Complete once `parse` has begun.
  CommandText describe() const;

  /// Parses and runs. 0, or 2 when the command line is wrong (said on stderr). `whirl help SUB` is `whirl SUB --help`.
  int parse(int argc, char** argv);

 private:
  struct State;
  explicit CommandLine(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace whirl::app
