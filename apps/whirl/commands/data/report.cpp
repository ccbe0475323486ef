#include <fmt/format.h>

#include <filesystem>

#include "command.hpp"
#include "commands/machine/record_options.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/output.hpp"
#include "whirl/pages/printed_page.hpp"
#include "whirl/pages/run_report.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {
namespace {

struct ReportFlags {
  std::vector<std::filesystem::path> files;
  std::filesystem::path out = "report.html", figures, pdf;
  std::vector<std::string> formats{"svg", "csv"};
  double service_rpm = 0, slow_roll_rpm = 0;
  std::string machine, title = pages::ReportOptions{}.title;
  std::filesystem::path about;
  bool paper = false;
  RecordOptions record;
};

/// The file about the machine, and what flags say instead.
pages::ReportOptions options_of(const ReportFlags& o, const Session& session) {
  pages::ReportOptions report = o.about.empty() ? pages::ReportOptions{} : pages::about_machine(o.about);
  if (o.service_rpm > 0) report.service_speed = o.service_rpm * kRadPerSecPerRpm;
  if (o.slow_roll_rpm > 0) report.slow_roll = o.slow_roll_rpm * kRadPerSecPerRpm;
  if (!o.machine.empty()) report.machine = diagnosis::machine_class(o.machine);
  report.title = o.title;
  report.with_paper = o.paper;
  report.command_line = session.command_line;
  return report;
}

void write_report(ReportFlags& o, Session& session) {
  const pages::ReportOptions options = options_of(o, session);
  session.progress("report: reading", 0);
  const pages::ReportInputs inputs = pages::read_report_inputs(
      o.files, [&](const std::filesystem::path& file) { return o.record.read(file.string()); });
  session.progress("report: drawing", 0.3);
  const report::Document document = pages::run_report(inputs, options);
  const std::string page = report::to_html(document),
                    pdf = o.pdf.empty() ? std::string() : pages::printed_page(page, o.pdf);
  session.write_together();
  io::write_text(o.out, page);
  if (!o.pdf.empty()) io::write_text(o.pdf, pdf);
  const auto figure_file = [&](long number, const std::string& format) {
    return o.figures / fmt::format("figure_{:02}.{}", number, format);
  };
  long figures = 0;
  if (!o.figures.empty()) {
    io::make_folder(o.figures);
    for (const report::Block& block : document.blocks) {
      const auto* figure = std::get_if<report::FigureBlock>(&block);
      if (figure == nullptr) continue;
      ++figures;
      for (const std::string& format : o.formats) {
        session.check_output(figure_file(figures, format), "figure");
        report::write_figure(figure->figure, figure_file(figures, format));
      }
    }
  }
  session.progress("report", 1);
  session.say(fmt::format("report: {} ({:.2f} MB)", o.out.string(), 1e-6 * static_cast<double>(page.size())));
  if (figures > 0) session.say(fmt::format("{} figures in {}", figures, o.figures.string()));
  if (!o.pdf.empty()) session.say("PDF: " + o.pdf.string());
  session.result(io::start_document("whirl.report", 1)
                     .set("report", o.out.string())
                     .set("pdf", o.pdf.string())
                     .set("figures", figures));
}

}  // namespace

void add_report(CommandLine& app, Session& session) {
  auto o = std::make_shared<ReportFlags>();
  CommandLine* sub = add_command(
      app, session, "report", "One page from any set of runs and results",
      "Input, in any order: records (any format of `whirl info`), logs of `whirl run --log`, Bode tables "
      "rpm,amp_um,phase_deg,\n"
      "and the JSON files that the other subcommands write: model, controller, frf, modes, stiffness, run, "
      "validation.\n"
      "Output: one self-contained HTML page: run maps, Bode and polar plots, orbits, waterfall, cascade, order tracks, "
      "identified\n"
      "equations with intervals, prediction of every record, closed loop with segments and effort, critical speeds "
      "with\n"
      "amplification factor and sweep rate, separation margin, zones of shaft and housing vibration, balance grade, "
      "provenance.\n"
      "A velocity or an acceleration is a sensor of a bearing housing: its level in mm/s rms, 10 Hz to 1 kHz, is "
      "stated, with the zone of --machine.\n\n"
      "Example: whirl report rundown.csv model.json controller.json log.csv --service-rpm 1800 --out report.html",
      [o, &session] { write_report(*o, session); });
  sub->add_option("FILES", o->files, "records, logs, tables and results")->input()->required();
  sub->add_option("--out", o->out, "HTML page to write")->output("HTML")->show_default();
  sub->add_option("--pdf", o->pdf, "also print the page to this PDF (needs chromium)")->output("PDF");
  sub->add_option("--figures", o->figures, "also write every figure into this folder")->output_folder();
  sub->add_option("--formats", o->formats, "of the figures: svg, png, pdf, csv")
      ->delimiter(',')
      ->one_of({"svg", "png", "pdf", "csv", "txt"})
      ->show_default();
  sub->add_option("--title", o->title, "of the page")->show_default();
  sub->add_option("--about", o->about,
                  "file (.toml) with name, date, analyst, speeds and class of the machine; flags override it")
      ->input();
  sub->add_option("--service-rpm", o->service_rpm,
                  "largest continuous speed: margin, zones and grade are stated for it")
      ->range(0, 1e6);
  sub->add_option("--slow-roll-rpm", o->slow_roll_rpm, "take off the mean 1X vector below this speed")->range(0, 1e6);
  sub->add_option("--machine", o->machine,
                  "group and support of ISO 20816-3, for the zones of housing vibration: group 1 above 300 kW, group 2 "
                  "above 15 kW to 300 kW; rigid: the lowest natural frequency on its support is 25 % above the main "
                  "excitation")
      ->one_of({"1-rigid", "1-flexible", "2-rigid", "2-flexible"});
  o->record.turning = true;
  o->record.add_to(sub, false);
  o->record.add_tacho_to(sub);
  sub->add_flag("--paper", o->paper, "the paper's Table 4 beside the segments");
}

}  // namespace whirl::app
