#include "program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <vector>

#include "command.hpp"
#include "commands/balance/balance.hpp"
#include "commands/balance/response.hpp"
#include "commands/machine/run_io.hpp"
#include "commands/modal/ambient.hpp"
#include "commands/modal/nonlinear_mode.hpp"
#include "commands/rotor/rotor.hpp"
#include "defaults.hpp"
#include "usage.hpp"
#include "whirl/core/kept_memory.hpp"
#include "whirl/core/tell.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/io/temporary.hpp"

namespace whirl::app {

void Session::say(const std::string& text) const {
  if (!json) fmt::print("{}\n", text);
}

void Session::note(const std::string& file, const std::string& remark, io::RemarkCode code) {
  const Remark entry{file, remark, code};
  if (std::find(remarks.begin(), remarks.end(), entry) != remarks.end()) return;
  remarks.push_back(entry);
  complain(io::is_information(code) ? "note" : "warning", file + ": " + remark);
}

void Session::result(const io::Json& value) const {
  if (!json) return;
  io::Json document = value;
  if (!remarks.empty()) {
    io::Json list = io::Json::array();
    for (const Remark& r : remarks)
      list.push(io::Json::object()
                    .set("file", r.file)
                    .set("text", r.text)
                    .set("code", std::string(to_string(r.code)))
                    .set("severity", io::is_information(r.code) ? "info" : "warning"));
    document.set("remarks", std::move(list));
  }
  fmt::print("{}\n", document.dump());
}

void Session::finish(const Summary& summary) {
  for (const std::string& warning : summary.warnings) complain("warning", warning);
  for (const std::string& note : summary.notes) say("note               " + note);
  if (!summary.trust.empty()) say(summary.trust);
  if (summary.status == Status::unusable) {
    complain("the numbers are not usable", summary.reason);
    exit_code = 1;
  }
}

void Session::progress(const std::string& what, double fraction) {
  if (quiet) return;
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto now = std::chrono::steady_clock::now();
  // A log file gets a line a second at most; a job that takes less than a second says nothing.
  if (now - last_progress_ < (terminal ? std::chrono::milliseconds(100) : std::chrono::seconds(1)) &&
      (fraction < 1 || !progress_shown_)) {
    return;
  }
  last_progress_ = now;
  progress_shown_ = fraction < 1;
  tell("{}{} {:3.0f} %{}", terminal ? "\r\033[K" : "", what, 100 * fraction, terminal && fraction < 1 ? "" : "\n");
  std::fflush(stderr);
}

constexpr const char* kPaper =
    "\n\nThe paper: Piramoon, Ayoubi, Bashash, IEEE Access 2024, doi 10.1109/ACCESS.2024.3449913; "
    "docs/paper-errata.md.";

CommandLine* add_command(CommandLine& app, Session& session, const std::string& name, const std::string& summary,
                         const std::string& details, std::function<void()> run) {
  CommandLine* sub = app.add_subcommand(name, summary);
  const bool cites = summary.find("paper") != std::string::npos || details.find("paper") != std::string::npos;
  sub->footer(details + (cites ? kPaper : ""));
  sub->add_flag("--json", session.json, "print the result as JSON on stdout");
  sub->add_flag("--quiet", session.quiet, "no progress on stderr");
  sub->callback([sub, &session, run = std::move(run)] {
    session.command = sub;
    run();
    session.commit_outputs();
  });
  return sub;
}

namespace {

struct Entry {
  const char* name;  ///< of the subcommand; empty: several, made of all the others
  void (*add)(CommandLine& app, Session& session);
};
struct Section {
  const char* heading;
  std::vector<Entry> commands;
};

/// In the order of --help.
const std::vector<Section>& sections() {
  static const std::vector<Section> all{
      {"Data: read, convert, show",
       {{"info", add_info}, {"convert", add_convert}, {"plot", add_plot}, {"report", add_report}}},
      {"Identification: equations of motion from records",
       {{"identify", add_identify}, {"validate", add_validate}, {"derive", add_derive}, {"simulate", add_simulate}}},
      {"Modal analysis: tests at standstill, ambient and run-up records",
       {{"stiffness", add_stiffness},
        {"frf", add_frf},
        {"modes", add_modes},
        {"oma", add_oma},
        {"nonlinear-mode", add_nonlinear_mode},
        {"transient", add_transient}}},
      {"Balancing and response", {{"balance", add_balance}, {"response", add_response}, {"runup", add_runup}}},
      {"Flexible rotors: from geometry", {{"rotor", add_rotor}, {"centrifuge", add_centrifuge}}},
      {"Control: design, test, export",
       {{"design", add_design},
        {"margins", add_margins},
        {"compare", add_compare},
        {"robustness", add_robustness},
        {"export", add_export}}},
      {"Running: hardware, records of a loop, live view",
       {{"run", add_run}, {"record", add_record}, {"replay", add_replay}, {"monitor", add_monitor}, {"io", add_io}}},
      {"Simulated test rig", {{"rig", add_rig}, {"reproduce", add_reproduce}}},
      {"Help", {{"", add_manual}}},
  };
  return all;
}

/// Gives the program its subcommands: the one that `word` names alone, for a description of all takes longer than many
/// a command; all of them where it is none, or where a file of defaults may name any.
void add_commands(CommandLine& app, Session& session, const std::string& word) {
  const auto named = [&](const Entry& e) { return word == e.name && !word.empty(); };
  const bool one = !defaults_file() && std::any_of(sections().begin(), sections().end(), [&](const Section& s) {
    return std::any_of(s.commands.begin(), s.commands.end(), named);
  });
  for (const Section& section : sections()) {
    app.section(section.heading);
    for (const Entry& entry : section.commands) {
      if (!one || named(entry)) entry.add(app, session);
    }
  }
  app.section();
}

int run(int argc, char** argv) {
  CommandLine app(
      "whirl: from records of a rotor's run-up or run-down to its nonlinear equations of motion, and from these to a\n"
      "controller of its vibration.\n",
      "whirl " + std::string(version()));
  app.require_subcommand();
  app.footer(
      "Files: records are CSV with a header of quantity_unit columns (t_s,x_mm,y_mm,beta_rad); see docs/formats.md.\n"
      "Which test and which command answer a question: docs/choosing.md.\n"
      "Exit code: 0 done, 1 the numbers are not usable (reason printed), 2 bad usage or bad input.\n\n"
      "Example: whirl identify rundown.csv --out model.json && whirl design model.json --mass-kg 1.5 --out "
      "controller.json");

  Session session;
  io::set_remark_handler(
      [&](const std::string& file, const std::string& text, io::RemarkCode code) { session.note(file, text, code); });
  add_commands(app, session, argc > 1 ? argv[1] : "");

  try {
    std::vector<std::string> words = with_defaults(app, {argv + 1, argv + argc});
    words.insert(words.begin(), argv[0]);
    session.command_line = fmt::format("{}", fmt::join(words, " "));
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    const int code = app.parse(static_cast<int>(arguments.size()), arguments.data());
    return code != 0 ? code : session.exit_code;
  } catch (const Error& e) {
    complain("error", e.what());
    return 2;
  } catch (const std::bad_alloc&) {
    tell("whirl: error: not enough memory for this input\n");
    return 2;
  } catch (const std::exception& e) {
    complain("error", e.what());
    return 2;
  }
}

}  // namespace

int program(int argc, char** argv) {
  keep_freed_memory();
  io::clean_up_on_signals();
  const int code = run(argc, argv);
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    tell("whirl: error: standard output cannot be written: {}\n", std::strerror(errno));
    return 2;
  }
  return code;
}

}  // namespace whirl::app
