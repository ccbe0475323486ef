#include <fmt/format.h>

#include <cmath>

#include "rotor.hpp"
#include "rotor_runs.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/shaft/fit/trend.hpp"

namespace whirl::app {
namespace {

struct RotorTrendOptions {
  std::string rotor;
  std::vector<std::string> runs;
  int restarts = 10;
};

void rotor_trend(const RotorTrendOptions& o, Session& session) {
  const shaft::RotorJob job = shaft::read_rotor_job(o.rotor);
  std::vector<shaft::OrderRun> runs;
  for (const std::string& file : o.runs) runs.push_back(load_run(file, job.rotor));
  shaft::FitOptions options;
  options.restarts = o.restarts;
  const shaft::FitTrend trend = shaft::fit_trend(job.rotor, job.fit, runs, options);
  report::Table table;
  table.caption = "unknowns of each run, and their change from the first to the last, 95 %";
  table.columns = {{"unknown", "", report::Align::left}, {"unit", "", report::Align::left}};
  for (const std::string& run : trend.runs) table.columns.push_back({run, ""});
  for (const char* name : {"change", "from", "to"}) table.columns.push_back({name, "%"});
  table.columns.push_back({"", "", report::Align::left});
  for (const shaft::TrendRow& row : trend.rows) {
    const ShownUnit unit = shown_unit(row.last.kind);
    std::vector<std::string> cells{row.last.name, unit.name};
    for (const Estimate& e : row.values)
      cells.push_back(std::isnan(e.value) ? "–" : report::format_number(unit.factor * e.value, 4));
    for (const double part : {row.change.value, row.change.low, row.change.high})
      cells.push_back(report::format_fixed(100 * part, 2));
    cells.emplace_back(!row.changed ? "holds" : row.change.value < 0 ? "falls" : "rises");
    table.add(std::move(cells));
  }
  table.notes = {fmt::format(
      "falls, rises: a straight line differs from none by more than {:.1f} standard deviations: one false alarm in a "
      "hundred such tables",
      trend.limit)};
  if (!trend.rows.empty()) session.say(report::to_text(table));
  session.result(shaft::to_json(trend));
  session.finish(trend.summary);
}

}  // namespace

void add_rotor_trend(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorTrendOptions>();
  CommandLine* sub = add_command(
      rotor, session, "trend", "Is it getting worse? Bearings, mounts and damping of run after run",
      "Input: a rotor file as `whirl rotor fit` takes it, and records of runs in the order of time. Each is fitted "
      "alone. Printed:\n"
      "the unknowns of every run, their change from the first to the last with its interval, and which of them fall or "
      "rise.\n"
      "A run that contradicts the rotor file is named and left out.\n\n"
      "Example: whirl rotor trend rotor.toml may.csv june.csv july.csv",
      [o, &session] { rotor_trend(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("RUNS", o->runs, "records in the order of time, two or more")->input()->required();
  sub->add_option("--restarts", o->restarts, "further starts where the first descent leaves a misfit")
      ->range(0, 1000)
      ->show_default();
}

}  // namespace whirl::app
