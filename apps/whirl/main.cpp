#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>

#include "command.hpp"
#include "commands/balance/balance.hpp"
#include "commands/balance/response.hpp"
#include "commands/machine/run_io.hpp"
#include "commands/modal/ambient.hpp"
#include "commands/modal/nonlinear_mode.hpp"
#include "commands/rotor/rotor.hpp"
#include "defaults.hpp"
#include "processor.hpp"
#include "usage.hpp"
#include "whirl/core/kept_memory.hpp"
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
  fmt::print(stderr, "{}{} {:3.0f} %{}", terminal ? "\r\033[K" : "", what, 100 * fraction,
             terminal && fraction < 1 ? "" : "\n");
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
  app.section("Data: read, convert, show");
  add_info(app, session);
  add_convert(app, session);
  add_plot(app, session);
  add_report(app, session);
  app.section("Identification: equations of motion from records");
  add_identify(app, session);
  add_validate(app, session);
  add_derive(app, session);
  add_simulate(app, session);
  app.section("Modal analysis: tests at standstill, ambient and run-up records");
  add_stiffness(app, session);
  add_frf(app, session);
  add_modes(app, session);
  add_oma(app, session);
  add_nonlinear_mode(app, session);
  add_transient(app, session);
  app.section("Balancing and response");
  add_balance(app, session);
  add_response(app, session);
  add_runup(app, session);
  app.section("Flexible rotors: from geometry");
  add_rotor(app, session);
  add_centrifuge(app, session);
  app.section("Control: design, test, export");
  add_design(app, session);
  add_margins(app, session);
  add_compare(app, session);
  add_robustness(app, session);
  add_export(app, session);
  app.section("Running: hardware, records of a loop, live view");
  add_run(app, session);
  add_record(app, session);
  add_replay(app, session);
  add_monitor(app, session);
  add_io(app, session);
  app.section("Simulated test rig");
  add_rig(app, session);
  add_reproduce(app, session);
  app.section("Help");
  add_manual(app, session);
  app.section();

  try {
    std::vector<std::string> words = with_defaults(app.describe(), {argv + 1, argv + argc});
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
    fmt::print(stderr, "whirl: error: not enough memory for this input\n");
    return 2;
  } catch (const std::exception& e) {
    complain("error", e.what());
    return 2;
  }
}

}  // namespace
}  // namespace whirl::app

int main(int argc, char** argv) {
  whirl::app::go_on_as_the_faster_build(argv);
  whirl::keep_freed_memory();
  whirl::io::clean_up_on_signals();
  const int code = whirl::app::run(argc, argv);
  // What was printed counts as written only when all of it has arrived.
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    fmt::print(stderr, "whirl: error: standard output cannot be written: {}\n", std::strerror(errno));
    return 2;
  }
  return code;
}
