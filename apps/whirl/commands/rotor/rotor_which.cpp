#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rotor.hpp"
#include "rotor_runs.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/shaft/fit/recognise.hpp"

namespace whirl::app {
namespace {

struct RotorWhichOptions {
  std::string record;
  std::vector<std::string> rotors;
  double torque_nm = 0, torque_percent = 5;
  int restarts = 10;
};

void rotor_which(const RotorWhichOptions& o, Session& session) {
  std::vector<shaft::RotorCandidate> candidates;
  for (const std::string& file : o.rotors) {
    const shaft::RotorJob job = shaft::read_rotor_job(file);
    candidates.push_back({file, job, load_run(o.record, job.rotor)});
  }
  shaft::FitOptions options;
  options.restarts = o.restarts;
  const shaft::RotorRecognition found =
      shaft::recognise_rotor(candidates, {o.torque_nm, 0.01 * o.torque_percent}, options);
  if (!std::isnan(found.inertia.value))
    session.say(fmt::format("moment of inertia  {} kg m^2 ({} to {}) by torque and acceleration",
                            report::format_number(found.inertia.value, 3), report::format_number(found.inertia.low, 3),
                            report::format_number(found.inertia.high, 3)));
  report::Table table;
  table.caption = "rotors that may be on it";
  table.columns = {
      {"file", "", report::Align::left}, {"", "", report::Align::left}, {"misfit", "sd"}, {"inertia", "kg m^2"}};
  for (const shaft::CandidateFit& c : found.candidates)
    table.add({c.name,
               c.possible()  ? "possible"
               : !c.explains ? "does not explain the vibration"
                             : "does not explain the acceleration",
               report::format_fixed(c.misfit.most(), 1), report::format_number(c.inertia, 3)});
  table.notes = {
      fmt::format("misfit: standard deviations beyond the noise; possible up to {:g}, {:g} in one band of speeds",
                  shaft::kMisfitLimit, shaft::kBandLimit)};
  session.say(report::to_text(table));
  session.result(shaft::to_json(found));
  session.finish(found.summary);
}

}  // namespace

void add_rotor_which(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorWhichOptions>();
  CommandLine* sub = add_command(
      rotor, session, "which", "Which rotor is on it? Drawings that explain a run, by vibration and inertia",
      "Input: a record of a run-up or run-down, and two rotor files or more as `whirl rotor fit` takes them. Each is "
      "fitted to the\n"
      "record with what its [fit] leaves open. With --torque-nm the acceleration shows the moment of inertia too. Exit "
      "code 1 where\n"
      "none of them explains the record.\n\n"
      "Example: whirl rotor which spinup.csv small.toml large.toml --torque-nm 1.5",
      [o, &session] { rotor_which(*o, session); });
  sub->add_option("RECORD", o->record, "record of the run")->input()->required();
  sub->add_option("ROTORS", o->rotors, "rotor files, two or more")->input()->required();
  sub->add_option("--torque-nm", o->torque_nm, "of the drive beyond its losses, constant")->range(0, 1e9);
  sub->add_option("--torque-percent", o->torque_percent, "half width within which the torque is known")
      ->range(0, 100)
      ->show_default();
  sub->add_option("--restarts", o->restarts, "further starts where the first descent leaves a misfit")
      ->range(0, 1000)
      ->show_default();
}

}  // namespace whirl::app
