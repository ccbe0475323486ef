#include <fmt/format.h>

#include <cmath>

#include "rotor.hpp"
#include "rotor_runs.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/pages/rotor_runs.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/shaft/fit/fit_json.hpp"

namespace whirl::app {
namespace {

struct RotorFitOptions {
  std::string rotor, out, motion;
  std::vector<std::string> runs;
  std::vector<double> at_mm;
  int points = 200, restarts = 10;
};

report::Table unknown_table(const shaft::RotorFit& fit) {
  report::Table table;
  table.caption = "unknowns, 95 % intervals";
  table.columns = {{"unknown", ""}, {"estimate", ""}, {"from", ""},  {"to", ""},
                   {"unit", ""},    {"angle", "deg"}, {"+-", "deg"}, {"", ""}};
  for (const shaft::FitRow& r : shaft::fit_rows(fit)) {
    const ShownUnit unit = shown_unit(r.kind);
    const auto show = [&](double v) { return report::format_number(unit.factor * v, 5); };
    table.add({r.name, show(r.value.value), show(r.value.low), show(r.value.high), unit.name,
               r.complex ? report::format_fixed(r.angle / kRadPerDegree, 2) : "",
               r.complex ? report::format_number(r.angle_half / kRadPerDegree, 2) : "",
               !r.identifiable                   ? "not identifiable"
               : r.complex && !(r.value.low > 0) ? "not different from zero"
                                                 : ""});
  }
  return table;
}

void say_fit(const shaft::RotorFit& fit, const std::vector<shaft::OrderRun>& runs, Session& session) {
  for (const shaft::OrderRun& run : runs)
    session.say(fmt::format("{:<18} {:.0f} to {:.0f} rpm, {} of {} a probe", run.name,
                            run.speed.minCoeff() * kRpmPerRadPerSec, run.speed.maxCoeff() * kRpmPerRadPerSec,
                            counted(run.blocks(), "vector"), counted(run.turns, "turn")));
  session.say(
      fmt::format("misfit             chi-square {:.4g} (1: the noise alone), {:.2g} times the scatter of the runs, "
                  "{:.1f} standard deviations; {}",
                  fit.misfit.chi_square, fit.misfit.scatter_ratio, fit.misfit.most(),
                  fit.misfit.explained ? "the model explains the records" : "the model does not explain the records"));
  session.say(fmt::format("descents           {}, {}", fit.starts, counted(fit.iterations, "iteration")));
  session.say(report::to_text(unknown_table(fit)));
  if (!fit.weak.empty()) session.say("what the records leave open (half width of 95 %, in parts of the values)");
  for (const shaft::WeakDirection& w : fit.weak) session.say(fmt::format("  {:<40} {:.2g}", w.words, w.half_width));
  if (fit.next.empty()) return;
  session.say(fmt::format("the next run, for {} (+-{:.2g} of it now)", fit.next.front().decides, fit.next.front().now));
  for (const shaft::NextRun& n : fit.next) session.say(fmt::format("  {}: +-{:.2g}", n.words, n.half_width));
}

void write_motion(const std::string& file, const std::vector<double>& speeds,
                  const std::vector<shaft::VirtualProbe>& motions, const std::vector<shaft::VirtualForce>& forces) {
  io::Table table;
  io::CsvWriteOptions csv;
  csv.units = {"speed_rpm"};
  table.columns.push_back({"speed", Quantity::angular_velocity,
                           Eigen::Map<const Eigen::VectorXd>(speeds.data(), static_cast<Eigen::Index>(speeds.size()))});
  const auto add = [&](const std::string& name, Quantity quantity, const char* unit, const Eigen::VectorXcd& z,
                       const Eigen::VectorXd& half) {
    table.columns.push_back({name + "_amp", quantity, z.cwiseAbs()});
    table.columns.push_back({name + "_half", quantity, half});
    table.columns.push_back({name + "_phase", Quantity::angle, -z.cwiseArg()});
    csv.units.insert(csv.units.end(), {name + "_amp_" + unit, name + "_half_" + unit, name + "_phase_deg"});
  };
  for (const shaft::VirtualProbe& v : motions) {
    const std::string name = pages::column_name(fmt::format("at_{:g}", 1e3 * v.position));
    add(name + "_x", Quantity::displacement, "um", v.x, v.x_half);
    add(name + "_y", Quantity::displacement, "um", v.y, v.y_half);
  }
  for (const shaft::VirtualForce& v : forces) {
    add(pages::column_name(v.support) + "_force_x", Quantity::force, "N", v.x, v.x_half);
    add(pages::column_name(v.support) + "_force_y", Quantity::force, "N", v.y, v.y_half);
  }
  io::write_csv(file, table, csv);
}

void rotor_fit(const RotorFitOptions& o, Session& session) {
  const shaft::RotorJob job = shaft::read_rotor_job(o.rotor);
  for (const double mm : o.at_mm) require_range("--at-mm", mm, 0, 1e3 * job.rotor.length() * (1 + 1e-9), "mm");
  std::vector<shaft::OrderRun> runs;
  for (const std::string& file : o.runs) runs.push_back(load_run(file, job.rotor));
  shaft::FitOptions options;
  options.restarts = o.restarts;
  const shaft::RotorFit fit = shaft::fit_rotor(job.rotor, job.fit, runs, options);
  double lowest = runs.front().speed.minCoeff(), highest = 0;
  for (const shaft::OrderRun& run : runs) {
    lowest = std::min(lowest, run.speed.minCoeff());
    highest = std::max(highest, run.speed.maxCoeff());
  }
  std::vector<double> speeds;
  for (int k = 0; k < o.points; ++k) speeds.push_back(lowest + (highest - lowest) * k / (o.points - 1));
  // A resonance is narrower than any grid: its peak is among the speeds.
  if (!o.at_mm.empty() || !o.motion.empty())
    speeds = pages::refined_response(fit.rotor, shaft::assemble(fit.rotor), speeds).speeds;
  std::vector<shaft::VirtualProbe> motions;
  std::vector<shaft::VirtualForce> forces;
  for (const double mm : o.at_mm) motions.push_back(shaft::virtual_probe(fit, 1e-3 * mm, speeds));
  for (std::size_t k = 0; (!o.at_mm.empty() || !o.motion.empty()) && k < job.rotor.supports.size(); ++k)
    if (job.rotor.supports[k].a.part == "shaft") forces.push_back(shaft::virtual_force(fit, k, speeds));
  say_fit(fit, runs, session);
  report::Table table;
  table.caption = "virtual probes, largest amplitude (zero-to-peak)";
  table.columns = {{"place", ""}, {"axis", ""}, {"amplitude", ""}, {"+-", ""}, {"unit", ""}, {"speed", "rpm"}};
  const auto largest = [&](const std::string& place, const char* axis, const Eigen::VectorXcd& z,
                           const Eigen::VectorXd& half, double factor, const char* unit) {
    Eigen::Index at = 0;
    z.cwiseAbs().maxCoeff(&at);
    table.add({place, axis, report::format_number(factor * std::abs(z[at]), 4),
               report::format_number(factor * half[at], 2), unit,
               report::format_fixed(speeds[static_cast<std::size_t>(at)] * kRpmPerRadPerSec, 0)});
  };
  for (const shaft::VirtualProbe& v : motions) {
    largest(fmt::format("{:g} mm", 1e3 * v.position), "x", v.x, v.x_half, 1e6, "um");
    largest(fmt::format("{:g} mm", 1e3 * v.position), "y", v.y, v.y_half, 1e6, "um");
  }
  for (const shaft::VirtualForce& v : forces) {
    largest("force of " + v.support, "x", v.x, v.x_half, 1, "N");
    largest("force of " + v.support, "y", v.y, v.y_half, 1, "N");
  }
  if (!table.rows.empty()) session.say(report::to_text(table));
  session.result(shaft::fit_json(fit, motions, forces));
  session.write_together();
  if (!o.out.empty()) io::write_text(o.out, shaft::rotor_text(fit.rotor));
  if (!o.motion.empty()) write_motion(o.motion, speeds, motions, forces);
  session.finish(fit.summary);
}

}  // namespace

void add_rotor_fit(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorFitOptions>();
  CommandLine* sub = add_command(
      rotor, session, "fit", "Bearings, damping and unbalance of the machine from its records",
      "Input: a rotor file with [[probe]], [[unbalance]] (stations; a size of 0 will do) and [fit], and records of "
      "run-ups or\n"
      "run-downs with a channel of each probe and key, tacho or beta. [fit] says what is unknown and within which "
      "tolerances the\n"
      "drawing holds, [[trial]] which run has a known mass (docs/rotor.md). The gain and the runout of every probe are "
      "unknown\n"
      "always. Printed: estimates with intervals, what the records leave open, which run would decide, and whether the "
      "model\n"
      "explains the records at all. --out writes the rotor with the estimates.\n\n"
      "Example: whirl rotor fit rotor.toml up.csv trial.csv --at-mm 1000 --out fitted.toml",
      [o, &session] { rotor_fit(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("RUNS", o->runs, "records, one a run")->input()->required();
  sub->add_option("--at-mm", o->at_mm, "station of a virtual probe: motion there with its interval; may be repeated");
  sub->add_option("--points", o->points, "speeds of the virtual probes at least; more around resonances")
      ->range(2, 100000)
      ->show_default();
  sub->add_option("--restarts", o->restarts, "further starts where the first descent leaves a misfit")
      ->range(0, 1000)
      ->show_default();
  sub->add_option("--out", o->out, "rotor file to write, with the estimates (.toml)")->output();
  sub->add_option("--motion", o->motion, "CSV file to write: virtual probes and forces of the supports over speed")
      ->output("table");
}

}  // namespace whirl::app
