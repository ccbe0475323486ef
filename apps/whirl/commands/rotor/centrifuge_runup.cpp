#include <fmt/format.h>

#include <cmath>

#include "rotor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/shaft/centrifuge/passage_plan.hpp"

namespace whirl::app {
namespace {

struct CentrifugeRunUpOptions {
  std::string rotor;
  double to_rpm = 0, limit_um = 0, torque_nm = 0;
};

std::string rate_text(double acceleration) {
  if (acceleration == 0) return "at most 30";
  return std::isinf(acceleration) ? "none" : report::format_number(acceleration * kRpmPerRadPerSec, 3);
}

void centrifuge_runup(const CentrifugeRunUpOptions& o, Session& session) {
  const shaft::RotorJob job = shaft::read_rotor_job(o.rotor);
  const shaft::PassagePlan plan =
      shaft::plan_passages(job.rotor, job.centrifuge,
                           {.limit = 1e-6 * o.limit_um, .highest = o.to_rpm * kRadPerSecPerRpm, .torque = o.torque_nm});
  session.say(
      fmt::format("moment of inertia  {} kg m^2, polar, of all that turns", report::format_number(plan.inertia, 4)));
  if (std::isfinite(plan.drive)) session.say(fmt::format("drive              {} rpm/s", rate_text(plan.drive)));
  report::Table table;
  table.caption = fmt::format("passages with {:.3g} g at the buckets; deflection at most {:g} um, 0 to peak",
                              1e3 * job.centrifuge.allowed, o.limit_um);
  table.columns = {
      {"critical speed", "rpm"},          {"from", "rpm"}, {"to", "rpm"},     {"needed", "rpm/s"}, {"largest", "um"},
      {"place", "", report::Align::left}, {"slow", "um"},  {"by drive", "um"}};
  const auto um = [](double value) { return std::isnan(value) ? "–" : report::format_number(1e6 * value, 3); };
  for (const shaft::Passage& p : plan.passages)
    table.add({report::format_fixed(p.critical * kRpmPerRadPerSec, 0),
               report::format_fixed(p.from * kRpmPerRadPerSec, 0), report::format_fixed(p.to * kRpmPerRadPerSec, 0),
               rate_text(p.needed), um(p.peak), p.place, um(p.peak_slow), um(p.peak_drive)});
  table.notes = {
      "needed: least acceleration from ... to ... that keeps the limit; elsewhere any. slow: at 30 rpm/s, the slowest "
      "looked at. largest: at "
      "what is needed."};
  session.say(plan.passages.empty() ? fmt::format("no forward critical speed up to {:g} rpm", o.to_rpm)
                                    : report::to_text(table));
  session.result(shaft::to_json(plan));
  session.finish(plan.summary);
}

}  // namespace

void add_centrifuge_runup(CommandLine& centrifuge, Session& session) {
  auto o = std::make_shared<CentrifugeRunUpOptions>();
  CommandLine* sub = add_command(
      centrifuge, session, "runup", "How fast through? Acceleration that each critical speed needs",
      "Input: a rotor file with [centrifuge]. Every passage of a forward critical speed up to --to-rpm is simulated "
      "with "
      "the allowed\n"
      "imbalance and half the load, over accelerations. Printed: the least that keeps the deflection of all probes (of "
      "the discs,\n"
      "where there is none) below --limit-um, and what the drive does with --torque-nm. Exit code 1 where a passage "
      "cannot keep it.\n\n"
      "Example: whirl centrifuge runup rotor.toml --to-rpm 6000 --limit-um 800 --torque-nm 1.5",
      [o, &session] { centrifuge_runup(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--to-rpm", o->to_rpm, "speed that is run up to")->range(1e-3, 1e7)->required();
  sub->add_option("--limit-um", o->limit_um, "largest deflection, 0 to peak")->range(1e-6, 1e6)->required();
  sub->add_option("--torque-nm", o->torque_nm, "of the drive beyond its losses")->range(0, 1e9);
}

}  // namespace whirl::app
