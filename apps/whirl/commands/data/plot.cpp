#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

#include "command.hpp"
#include "commands/machine/record_options.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/pages/bode_table.hpp"
#include "whirl/pages/run_report.hpp"
#include "whirl/report/terminal_plot.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {
namespace {

report::TerminalOptions terminal() {
  report::TerminalOptions options;
  winsize size{};
  if (isatty(STDOUT_FILENO) != 0) {
    options.color = true;
    if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col >= 40)
      options.columns = std::min<int>(size.ws_col, 200);
  }
  return options;
}

struct PlotOptions {
  std::vector<std::string> files, out;
  std::string what = "traces", window, amplitude = "peak", unit, phase = "lag";
  double slow_roll_rpm = 0;
  RecordOptions record;
  pages::ViewOptions view;
};

/// The plane of a 1X vector does not show its speeds: its CSV is that of the Bode plot, which other commands read.
bool is_vector_table(const std::string& what, const std::filesystem::path& file) {
  return (what == "polar" || what == "nyquist") && file.extension() == ".csv";
}

void draw(PlotOptions* o, Session& session) {
  pages::ViewOptions& view_options = o->view;
  if (!o->window.empty()) {
    view_options.window = o->window == "hann"       ? signal::Window::hann
                          : o->window == "flat-top" ? signal::Window::flat_top
                                                    : signal::Window::rectangular;
  }
  view_options.scale.kind = o->amplitude == "peak"  ? AmplitudeKind::peak
                            : o->amplitude == "rms" ? AmplitudeKind::rms
                                                    : AmplitudeKind::peak_to_peak;
  if (!o->unit.empty()) view_options.scale.unit = pages::motion_unit(o->unit);
  view_options.phase = o->phase == "lead" ? report::Phase::lead : report::Phase::lag;
  view_options.slow_roll = o->slow_roll_rpm * kRadPerSecPerRpm;
  report::Figure figure, vectors;
  const bool with_vectors = std::ranges::any_of(o->out, [&](const auto& f) { return is_vector_table(o->what, f); });
  std::vector<signal::SynchronousCurve> tables;
  std::size_t files_of_tables = 0;
  if (o->what == "bode" || o->what == "polar" || o->what == "nyquist") {
    for (const std::string& file : o->files) {
      const std::vector<signal::SynchronousCurve> curves = pages::read_bode_table(file);
      files_of_tables += curves.empty() ? 0 : 1;
      tables.insert(tables.end(), curves.begin(), curves.end());
    }
  }
  if (!tables.empty()) {
    if (files_of_tables != o->files.size()) throw Error("Bode tables and records cannot be drawn in one figure");
    figure = pages::synchronous_view(o->what, tables, view_options.phase, view_options.scale);
    if (with_vectors) vectors = pages::synchronous_view("bode", tables, view_options.phase, view_options.scale);
    for (const std::string& file : o->files) figure.runs.push_back(std::filesystem::path(file).filename().string());
  } else {
    std::vector<pages::ViewedRun> runs;
    for (const std::string& file : o->files) {
      for (pages::ViewedRun& run :
           pages::viewed_runs(o->record.read(file), std::filesystem::path(file).stem().string())) {
        runs.push_back(std::move(run));
      }
    }
    figure = pages::view(o->what, runs, view_options);
    if (with_vectors) vectors = pages::view("bode", runs, view_options);
  }
  session.write_together();
  for (const std::string& file : o->out) report::write_figure(is_vector_table(o->what, file) ? vectors : figure, file);
  if (o->out.empty() && !session.json) fmt::print("{}", report::to_terminal(figure, terminal()));
  for (const std::string& file : o->out) session.say("figure: " + file);
  io::Json json =
      io::start_document("whirl.plot", 1).set("what", o->what).set("files", o->out).set("title", figure.title);
  session.result(json);
}

}  // namespace

void add_plot(CommandLine& app, Session& session) {
  auto o = std::make_shared<PlotOptions>();
  std::string list;
  for (const pages::View& v : pages::views()) list += fmt::format("  {:<15}{}\n", v.name, v.shows);
  CommandLine* sub = add_command(
      app, session, "plot", "Draw a record: time traces, orbit, spectra, waterfall, Bode, polar, order tracks",
      "Input: records with a time (CSV t_s,x_mm,y_mm,beta_rad, or another format), or for bode and polar a "
      "table\n"
      "rpm,amp_um,phase_deg. The first of several files is drawn grey behind the others. The log of `whirl run` is "
      "drawn as two\n"
      "runs, open and closed loop. Bode, polar, orders, cascade and run-map need the rotor angle: beta_rad, or the "
      "pulses of a\n"
      "channel key, keyphasor or tacho (--pulses), or a speed_rpm, which has no phase. Phase is lag (the peak comes "
      "that angle after the mark) or, with --phase lead, "
      "its negative.\n\n"
      "--what:\n" +
          list +
          "\nOutput: the terminal, or with --out FILE.svg, .png, .pdf, .csv (the data behind the figure; of polar and "
          "nyquist\n"
          "those of bode) or .txt.\n\n"
          "Example: whirl plot rundown.csv --what bode --out bode.svg --out bode.csv",
      [o, &session] { draw(o.get(), session); });
  sub->add_option("FILE", o->files, "records, or Bode tables")->input()->required();
  sub->add_option("--what", o->what, "which figure, see below")->show_default();
  sub->add_option("--out", o->out, "FILE.svg, .png, .pdf, .csv or .txt; may be given more than once")->output("figure");
  sub->add_option("--channels", o->view.channels,
                  "default x and y, else the motions of one quantity; one of them in maps, orders, phase-plane")
      ->delimiter(',');
  sub->add_option("--from", o->view.begin, "begin, s")->range(-1e9, 1e9);
  sub->add_option("--to", o->view.end, "end, s")->range(-1e9, 1e9);
  sub->add_option("--highest-hz", o->view.highest_frequency, "of spectra; default half the rate, in maps 4X")
      ->range(0, 1e9);
  sub->add_option("--resolution-hz", o->view.resolution,
                  "between lines; default one block for spectra, for maps what the sweep lets pass")
      ->range(0, 1e9);
  sub->add_option("--window", o->window, "default hann; flat-top for maps without a rotor angle")
      ->one_of({"hann", "flat-top", "rectangular"});
  sub->add_option("--amplitude", o->amplitude,
                  "of spectra, maps, bode, polar, nyquist and orders: peak, p-p (pp) or rms")
      ->one_of({"peak", "p-p", "pp", "rms"})
      ->show_default();
  sub->add_option(
      "--unit", o->unit,
      "of the motion: um, mm, mil, mm_s, in_s, m_s2, g, ...; that of another quantity integrates the channel "
      "(acceleration in mm_s)");
  sub->add_option(
         "--lowest-hz", o->view.lowest_frequency,
         "of an integration; below it slow motion and drift are left out. The vectors of bode, polar and orders "
         "need no limit")
      ->range(1e-6, 1e9)
      ->needs("--unit")
      ->show_default();
  sub->add_option("--phase", o->phase, "of bode, polar and orders: lag, counted against the rotation, or lead")
      ->one_of({"lag", "lead"})
      ->show_default();
  sub->add_option("--orders", o->view.orders, "for order tracks; bode and polar take the first")
      ->range(0.01, 100)
      ->delimiter(',')
      ->show_default();
  sub->add_option("--bandwidth-hz", o->view.bandwidth,
                  "of the Vold-Kalman filter; default a quarter of the mean speed, wider in a fast run")
      ->range(0, 1e6);
  sub->add_option("--turns", o->view.turns, "revolutions per vector of bode and polar")
      ->range(1, 10000)
      ->show_default();
  sub->add_option("--slow-roll-rpm", o->slow_roll_rpm, "take off the mean 1X vector below this speed")->range(0, 1e6);
  sub->add_option("--natural-hz", o->view.natural_frequencies, "natural frequencies to mark in maps")
      ->range(0, 1e9)
      ->delimiter(',');
  o->record.turning = true;
  o->record.add_to(sub);
  o->record.add_tacho_to(sub);
}

}  // namespace whirl::app
