#include <fmt/format.h>

#include <cmath>

#include "rotor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/report/units.hpp"
#include "whirl/report/write_figure.hpp"
#include "whirl/shaft/reduction.hpp"
#include "whirl/shaft/rotor_json.hpp"
#include "whirl/shaft/transient.hpp"

namespace whirl::app {
namespace {

struct RotorRunOptions {
  std::string rotor, out, figure;
  double from_rpm = 0, to_rpm = 0, seconds = 0, rate_hz = 1000;
  int modes = 8;
  bool full = false, weight = false;
};

struct RunPlace {
  std::string name;
  Eigen::Index node;
  double angle;
  bool probe;
};

/// The probes of the file; without any, the discs.
std::vector<RunPlace> run_places(const LoadedRotor& loaded) {
  std::vector<RunPlace> list;
  for (const shaft::Probe& p : loaded.rotor.probes)
    list.push_back({p.name, loaded.system.node_at(p.position), p.angle, true});
  if (list.empty())
    for (const shaft::Disc& d : loaded.rotor.discs)
      list.push_back({d.name, loaded.system.node_at(d.position), 0, false});
  return list;
}

void write_run(const std::string& file, const shaft::RotorRun& run, const std::vector<RunPlace>& places) {
  io::Table table;
  io::CsvWriteOptions csv;
  table.columns.push_back({"t", Quantity::time, run.time});
  const auto add = [&](const std::string& name, Eigen::VectorXd values) {
    table.columns.push_back({name, Quantity::displacement, std::move(values)});
    csv.units.push_back(name + "_um");
  };
  for (const RunPlace& p : places) {
    const std::string name = column_name(p.name);
    const Eigen::VectorXd x = run.x.row(p.node).transpose(), y = run.y.row(p.node).transpose();
    if (p.probe) {
      add(name, std::cos(p.angle) * x + std::sin(p.angle) * y);
    } else {
      add(name + "_x", x);
      add(name + "_y", y);
    }
  }
  table.columns.push_back({"beta", Quantity::angle, run.angle});
  io::write_csv(file, table, csv);
}

report::Figure run_figure(const shaft::RotorRun& run, const std::vector<RunPlace>& places, const std::string& file) {
  report::Figure figure;
  figure.title = "Run of the rotor";
  figure.description = "Distance of the shaft from the line of its bearings over speed.";
  report::Panel& panel = figure.panel("", {"rotor speed", report::kRpm}, {"deflection, peak", {}});
  panel.height = 300;
  for (const RunPlace& p : places) {
    const Eigen::VectorXd size =
        (run.x.row(p.node).array().square() + run.y.row(p.node).array().square()).sqrt().matrix().transpose();
    panel.line(p.name, run.speed, size);
  }
  report::show_y_as(panel, Quantity::displacement);
  figure.runs = {std::filesystem::path(file).filename().string()};
  return figure;
}

void rotor_run(const RotorRunOptions& o, Session& session) {
  const LoadedRotor loaded = load_rotor(o.rotor);
  const std::vector<RunPlace> places = run_places(loaded);
  if (places.empty()) throw Error(o.rotor + ": no [[probe]] and no [[disc]]: nothing to look at");
  shaft::RunOptions options;
  options.from = o.from_rpm * kRadPerSecPerRpm;
  options.to = o.to_rpm * kRadPerSecPerRpm;
  options.duration = o.seconds;
  options.sample_time = 1 / o.rate_hz;
  options.weight = o.weight;
  Summary summary;
  double reduction_error = 0;
  shaft::RotorRun run;
  if (o.full) {
    run = shaft::simulate_run(loaded.system, options);
  } else {
    shaft::ReductionOptions reduction;
    reduction.modes = o.modes;
    reduction.highest = std::max(options.from, options.to);
    const shaft::Reduction reduced = shaft::reduce(loaded.system, reduction);
    reduction_error = reduced.worst_error;
    session.say(
        fmt::format("model              {} coordinates a plane of {}; error of the unbalance response {:.2g} % at most "
                    "({:.0f} rpm)",
                    reduced.system.size(), loaded.system.size(), 100 * reduced.worst_error,
                    reduced.worst_speed / kRadPerSecPerRpm));
    if (reduced.worst_error > 0.01)
      summary.warn("the reduced model differs from the full one by more than 1 %: raise --modes or use --full");
    run = shaft::simulate_run(reduced.system, options);
  }
  if (!run.x.allFinite()) summary.fail("the motion grows without bound: the rotor is unstable in this range");
  session.say(fmt::format("step               {:.3g} ms, its error {:.1g} of the largest deflection", 1e3 * run.step,
                          run.step_error));
  if (run.step_error > 1e-3) summary.warn("the time steps are too long for this motion: raise --rate-hz");
  report::Table table;
  table.caption = "largest deflection, sqrt(x^2 + y^2)";
  table.columns = {{"place", ""}, {"peak", "um"}, {"speed", "rpm"}, {"time", "s"}};
  std::vector<std::string> names;
  std::vector<shaft::RunPeak> peaks;
  for (const RunPlace& p : places) {
    peaks.push_back(shaft::run_peak(run, p.node));
    names.push_back(p.name);
    table.add({p.name, report::format_number(1e6 * peaks.back().size, 4),
               report::format_fixed(peaks.back().speed / kRadPerSecPerRpm, 1),
               report::format_fixed(peaks.back().time, 3)});
  }
  session.say(report::to_text(table));
  session.result(shaft::run_json(run, names, peaks, reduction_error));
  session.write_together();
  if (!o.out.empty()) write_run(o.out, run, places);
  if (!o.figure.empty()) report::write_figure(run_figure(run, places, o.rotor), o.figure);
  session.finish(summary);
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
      "_y) in um, and beta_rad.\n\n"
      "Example: whirl rotor run rotor.toml --from-rpm 4000 --to-rpm 100 --seconds 15 --out rundown.csv",
      [o, &session] { rotor_run(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--from-rpm", o->from_rpm, "first speed")->range(0, 1e7)->required();
  sub->add_option("--to-rpm", o->to_rpm, "last speed")->range(0, 1e7)->required();
  sub->add_option("--seconds", o->seconds, "length of the run")->range(1e-3, 1e5)->required();
  sub->add_option("--rate-hz", o->rate_hz, "samples a second")->range(1, 1e6)->show_default();
  sub->add_flag("--full", o->full, "every coordinate instead of the reduced model");
  sub->add_option("--modes", o->modes, "modes of a plane that the reduced model keeps")
      ->range(1, 1000)
      ->show_default()
      ->excludes("--full");
  sub->add_flag("--weight", o->weight, "gravity acts");
  sub->add_option("--out", o->out, "CSV file to write")->output("record");
  sub->add_option("--figure", o->figure, "deflection over speed (.svg, .png, .pdf, .csv)")->output();
}

}  // namespace whirl::app
