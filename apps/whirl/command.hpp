#pragma once
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/io/json.hpp"
#include "whirl/io/output.hpp"
#include "whirl/io/remarks.hpp"

namespace whirl::app {

/// Of a reader or writer: file and sentence.
struct Remark {
  std::string file, text;
  io::RemarkCode code = io::RemarkCode::other;
  bool operator==(const Remark&) const = default;
};

/// What all subcommands share: how to print and which exit code the program ends with.
///
/// Exit codes: 0 done; 1 the numbers are not usable (the reason is printed); 2 bad usage or bad input.
struct Session {
  bool json = false;
  bool quiet = false;
  int exit_code = 0;
  std::string command_line;
  const CommandLine* command = nullptr;  ///< that runs
  std::vector<Remark> remarks;           ///< of readers and writers

  /// Prints a remark on stderr, once, and keeps it for the JSON result.
  void note(const std::string& file, const std::string& remark, io::RemarkCode code);

  /// Prints text for a person; nothing under --json.
  void say(const std::string& text) const;
  /// Prints the JSON result under --json, with `remarks` where there are any; nothing otherwise.
  void result(const io::Json& value) const;
  /// Prints warnings, and sets exit code 1 when the status is `unusable`.
  void finish(const Summary& summary);
  /// Refuses to write a file whose name the command chose itself, as if it stood on the command line.
  void check_output(const std::filesystem::path& path, const std::string& kind = "") const {
    command->check_output(path, kind);
  }
  /// What is written from here on gets its name at the end of the command: all of it or, after an error, none.
  void write_together() { outputs_.emplace(); }
  void commit_outputs() {
    if (outputs_) outputs_->commit();
  }
  /// One progress line on stderr, rewritten in place on a terminal; silent under --quiet.
  void progress(const std::string& what, double fraction);

 private:
  std::chrono::steady_clock::time_point last_progress_ = std::chrono::steady_clock::now();
  bool progress_shown_ = false;
  std::optional<io::OutputGroup> outputs_;
};

/// Adds a subcommand with its help: one line what it does, then the inputs with columns and units, then an example.
CommandLine* add_command(CommandLine& app, Session& session, const std::string& name, const std::string& summary,
                         const std::string& details, std::function<void()> run);

// One function per subcommand.
void add_info(CommandLine& app, Session& session);
void add_convert(CommandLine& app, Session& session);
void add_stiffness(CommandLine& app, Session& session);
void add_frf(CommandLine& app, Session& session);
void add_modes(CommandLine& app, Session& session);
void add_derive(CommandLine& app, Session& session);
void add_identify(CommandLine& app, Session& session);
void add_validate(CommandLine& app, Session& session);
void add_design(CommandLine& app, Session& session);
void add_run(CommandLine& app, Session& session);
void add_monitor(CommandLine& app, Session& session);
void add_compare(CommandLine& app, Session& session);
void add_margins(CommandLine& app, Session& session);
void add_robustness(CommandLine& app, Session& session);
void add_plot(CommandLine& app, Session& session);
void add_report(CommandLine& app, Session& session);
void add_transient(CommandLine& app, Session& session);
void add_export(CommandLine& app, Session& session);
void add_rig(CommandLine& app, Session& session);
void add_io(CommandLine& app, Session& session);
void add_reproduce(CommandLine& app, Session& session);
void add_manual(CommandLine& app, Session& session);  // and completion

}  // namespace whirl::app
