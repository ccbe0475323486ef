#include <fmt/format.h>

#include <cmath>

#include "rotor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/pages/rotor_runs.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/report/units.hpp"
#include "whirl/report/write_figure.hpp"
#include "whirl/shaft/control/control_json.hpp"
#include "whirl/shaft/rotor_json.hpp"

namespace whirl::app {
namespace {

struct RotorRunOptions {
  std::string rotor, out, figure, controller;
  double from_rpm = 0, to_rpm = 0, seconds = 0, rate_hz = 1000;
  double noise_db = 0, probe_noise_um = 0;
  std::uint64_t seed = 1;
  int modes = 8;
  bool full = false, weight = false;
};

void write_run(const std::string& file, const Recording& record) {
  io::Table table;
  io::CsvWriteOptions csv;
  const auto time = Eigen::VectorXd::LinSpaced(record.size(), 0, record.dt * static_cast<double>(record.size() - 1));
  table.columns.push_back({"t", Quantity::time, time});
  for (const Channel& c : record.channels) {
    table.columns.push_back({c.name, c.quantity, c.samples});
    if (c.quantity == Quantity::displacement) csv.units.push_back(c.name + "_um");
  }
  io::write_csv(file, table, csv);
}

report::Figure run_figure(const shaft::RotorRun& run, const std::vector<pages::RotorPlace>& places,
                          const std::string& file) {
  report::Figure figure;
  figure.title = "Run of the rotor";
  figure.description = "Distance of the shaft from the line of its bearings over speed.";
  report::Panel& panel = figure.panel("", {"rotor speed", report::kRpm}, {"deflection, peak", {}});
  panel.height = 300;
  for (const pages::RotorPlace& p : places) {
    const Eigen::VectorXd size =
        (run.x.row(p.node).array().square() + run.y.row(p.node).array().square()).sqrt().matrix().transpose();
    panel.line(p.name, run.speed, size);
  }
  report::show_y_as(panel, Quantity::displacement);
  figure.runs = {std::filesystem::path(file).filename().string()};
  return figure;
}

void say_passages(const pages::RotorRecord& made, const shaft::RotorController& controller, Session& session) {
  report::Table table;
  table.caption = "passages: largest deflection of all probes and discs, without and with control";
  table.columns = {{"critical", "rpm"}, {"open", "um"}, {"closed", "um"}, {"less", "%"}};
  for (const shaft::Actuator& a : controller.actuators) table.columns.push_back({"force " + a.name, "N"});
  for (const shaft::ControlledPassage& p : made.passages) {
    const bool open = std::isfinite(p.open);
    std::vector<std::string> row{
        report::format_fixed(p.speed / kRadPerSecPerRpm, 0), open ? report::format_number(1e6 * p.open, 4) : "unstable",
        report::format_number(1e6 * p.closed, 4), open ? report::format_fixed(100 * (1 - p.closed / p.open), 1) : ""};
    for (const double force : p.force) row.push_back(report::format_number(force, 3));
    table.add(row);
  }
  session.say(report::to_text(table));
  if (made.unstable)
    session.say(fmt::format("without control    unstable from {:.5g} rpm", *made.unstable / kRadPerSecPerRpm));
}

void rotor_run(const RotorRunOptions& o, Session& session) {
  pages::SimulatedRun options;
  options.run.from = o.from_rpm * kRadPerSecPerRpm;
  options.run.to = o.to_rpm * kRadPerSecPerRpm;
  options.run.duration = o.seconds;
  options.run.sample_time = 1 / o.rate_hz;
  options.run.weight = o.weight;
  options.full = o.full;
  options.modes = o.modes;
  options.noise_db = o.noise_db;
  options.seed = o.seed;
  if (!o.controller.empty()) {
    options.probe_noise = 1e-6 * o.probe_noise_um;
    options.controller = shaft::load_rotor_controller(o.controller);
    // The record keeps every n-th sample of the controller.
    const double rate = 1 / options.controller->sample_time;
    options.run.sample_time = options.controller->sample_time * std::max(1.0, std::round(rate / o.rate_hz));
  }
  const pages::RotorRecord made = pages::simulated_record(shaft::read_rotor_job(o.rotor), options, o.rotor);
  const shaft::RotorRun& run = made.run;
  if (!o.full)
    session.say(fmt::format(
        "model              {} coordinates a plane of {}; error of the unbalance response {:.2g} % at most "
        "({:.0f} rpm)",
        made.coordinates, made.all_coordinates, 100 * made.reduction_error, made.reduction_speed / kRadPerSecPerRpm));
  session.say(fmt::format("step               {:.3g} ms, its error {:.1g} of the largest deflection", 1e3 * run.step,
                          run.step_error));
  report::Table table;
  table.caption = "largest deflection, sqrt(x^2 + y^2)";
  table.columns = {{"place", ""}, {"peak", "um"}, {"speed", "rpm"}, {"time", "s"}};
  std::vector<std::string> names;
  for (std::size_t k = 0; k < made.places.size(); ++k) {
    const shaft::RunPeak& peak = made.peaks[k];
    names.push_back(made.places[k].name);
    table.add({names.back(), report::format_number(1e6 * peak.size, 4),
               report::format_fixed(peak.speed / kRadPerSecPerRpm, 1), report::format_fixed(peak.time, 3)});
  }
  session.say(report::to_text(table));
  io::Json document = shaft::run_json(run, names, made.peaks, made.reduction_error);
  if (options.controller) {
    say_passages(made, *options.controller, session);
    document.set("passages", shaft::passages_json(made.passages));
  }
  session.result(document);
  session.write_together();
  if (!o.out.empty()) write_run(o.out, made.record);
  if (!o.figure.empty()) report::write_figure(run_figure(run, made.places, o.rotor), o.figure);
  session.finish(made.summary);
}

}  // namespace

void add_rotor_run(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorRunOptions>();
  CommandLine* sub = add_command(
      rotor, session, "run", "Simulate a run-up or run-down through the critical speeds",
      "Input: a rotor file. The run begins in the steady response at its first speed; the speed changes at a "
      "constant rate.\n"
      "The step of the integration is halved until it no longer matters. --out writes t_s, the probes (or the "
      "discs, _x and\n"
      "_y) in um, the accelerometers in m/s^2, and beta_rad.\n\n"
      "Example: whirl rotor run rotor.toml --from-rpm 4000 --to-rpm 100 --seconds 15 --out rundown.csv",
      [o, &session] { rotor_run(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--from-rpm", o->from_rpm, "first speed")->range(0, 1e7)->required();
  sub->add_option("--to-rpm", o->to_rpm, "last speed")->range(0, 1e7)->required();
  sub->add_option("--seconds", o->seconds, "length of the run")->range(1e-3, 1e5)->required();
  sub->add_option("--rate-hz", o->rate_hz, "samples a second")->range(1, 1e6)->show_default();
  sub->add_option("--controller", o->controller,
                  "controller of `whirl rotor control`: the run is made with it, and without it beside")
      ->input();
  sub->add_option("--probe-noise-um", o->probe_noise_um, "noise of every probe that the controller reads, rms")
      ->range(0, 1e6)
      ->show_default();
  sub->add_flag("--full", o->full, "every coordinate instead of the reduced model");
  sub->add_option("--modes", o->modes, "modes of a plane that the reduced model keeps")
      ->range(1, 1000)
      ->show_default()
      ->excludes("--full");
  sub->add_flag("--weight", o->weight, "gravity acts");
  sub->add_option("--noise-db", o->noise_db,
                  "noise is added to what is written: rms of a channel over that of its noise")
      ->range(0, 200);
  sub->add_option("--seed", o->seed, "of the noise")->show_default();
  sub->add_option("--out", o->out, "CSV file to write")->output("record");
  sub->add_option("--figure", o->figure, "deflection over speed (.svg, .png, .pdf, .csv)")->output();
}

}  // namespace whirl::app
