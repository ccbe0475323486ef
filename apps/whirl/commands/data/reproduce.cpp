#include <fmt/format.h>

#include <chrono>

#include "command.hpp"
#include "whirl/pages/run_json.hpp"
#include "whirl/report/document.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/study/study.hpp"
#include "whirl/study/study_report.hpp"

namespace whirl::app {

void add_reproduce(CommandLine& app, Session& session) {
  struct Options {
    std::string rig;
    study::StudyOptions study;
  };
  auto o = std::make_shared<Options>();
  o->study.folder = "out/reproduce";
  CommandLine* sub = add_command(
      app, session, "reproduce", "The whole study of the paper on the simulated rig, with one HTML report",
      "Stiffness test, hammer test, run-ups and run-downs (balanced, 2.5 g, 5 g, with and without 20 dB noise),\n"
      "identification by the paper's chain and by the weak form, validation, controller design, closed loop.\n"
      "Output: report.html and every intermediate file (CSV, JSON) in the folder.\n\n"
      "Example: whirl reproduce --out out/reproduce --seed 1",
      [o, &session] {
        require_range("--evaluations", o->study.evaluations, 10, 100000);
        session.check_output(o->study.folder / "rig.toml");
        session.check_output(o->study.folder / "report.html");
        o->study.rig = rig::read_rig(o->rig);
        o->study.command_line =
            fmt::format("whirl reproduce --seed {} --evaluations {}", o->study.seed, o->study.evaluations);
        o->study.progress = [&](const std::string& step, double fraction) { session.progress(step, fraction); };
        const study::Study study = study::run_study(o->study);
        const std::filesystem::path page = o->study.folder / "report.html";
        report::write_html(study::study_report(study), page, true);
        session.say(
            report::to_text(pages::segment_table(study.run("5g_tsmc").run.metrics, "5 g, TSMC (eq. 43)", true)));
        session.say(report::to_text(study::accuracy_table(study)));
        session.say(study::feedforward_statement(study));
        session.say("report: " + page.string());
        session.result(io::Json::object().set("report", page.string()));
      });
  sub->add_option("--out", o->study.folder, "folder for the report and all files")->output_folder()->show_default();
  sub->add_option("--rig", o->rig, "TOML with rig parameters that differ from the default")->input();
  sub->add_option("--seed", o->study.seed, "of all noise")->show_default();
  sub->add_option("--evaluations", o->study.evaluations, "tuning budget per control law")->show_default();
}

}  // namespace whirl::app
