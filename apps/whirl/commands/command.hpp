#pragma once
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/io/json.hpp"

namespace whirl::app {

/// What all subcommands share: how to print and which exit code the program ends with.
///
/// Exit codes: 0 done; 1 the numbers are not usable (the reason is printed); 2 bad usage or bad input.
struct Session {
  bool json = false;
  bool quiet = false;
  int exit_code = 0;
  std::string command_line;

  /// Prints text for a person; nothing under --json.
  void say(const std::string& text) const;
  /// Prints the JSON result under --json; nothing otherwise.
  void result(const io::Json& value) const;
  /// Prints warnings, and sets exit code 1 when the status is `unusable`.
  void finish(const Summary& summary);
  /// One progress line on stderr, rewritten in place on a terminal; silent under --quiet.
  void progress(const std::string& what, double fraction);

 private:
  std::chrono::steady_clock::time_point last_progress_ = std::chrono::steady_clock::now();
  bool progress_shown_ = false;
};

/// Adds a subcommand with its help: one line what it does, then the inputs with columns and units, then an example.
CLI::App* add_command(CLI::App& app, Session& session, const std::string& name, const std::string& summary,
                      const std::string& details, std::function<void()> run);

// One function per subcommand.
void add_info(CLI::App& app, Session& session);
void add_convert(CLI::App& app, Session& session);
void add_stiffness(CLI::App& app, Session& session);
void add_frf(CLI::App& app, Session& session);
void add_modes(CLI::App& app, Session& session);
void add_derive(CLI::App& app, Session& session);
void add_identify(CLI::App& app, Session& session);
void add_validate(CLI::App& app, Session& session);
void add_design(CLI::App& app, Session& session);
void add_run(CLI::App& app, Session& session);
void add_monitor(CLI::App& app, Session& session);
void add_compare(CLI::App& app, Session& session);
void add_robustness(CLI::App& app, Session& session);
void add_plot(CLI::App& app, Session& session);
void add_report(CLI::App& app, Session& session);
void add_transient(CLI::App& app, Session& session);
void add_export(CLI::App& app, Session& session);
void add_rig(CLI::App& app, Session& session);
void add_io(CLI::App& app, Session& session);
void add_reproduce(CLI::App& app, Session& session);

}  // namespace whirl::app
