#include <fmt/format.h>

#include <algorithm>

#include "rotor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/shaft/control/control_json.hpp"

namespace whirl::app {
namespace {

struct RotorControlOptions {
  std::string rotor, out, controller, law = "lqg";
  double from_rpm = 0, to_rpm = 0, rate_hz = 5000, sensitivity = 3, adaptation = 2, share = 80, force_weight = 0.1;
  int modes = 6, schedule = 6, points = 25;
  bool unbalance_unknown = false;
};

constexpr double kGrows = 1e-3;  // 1/s; as the refusals

void say_design(const shaft::ControlDesign& d, Session& session) {
  const std::vector<shaft::Actuator>& actuators = d.controller.actuators;
  report::Table table;
  table.caption = "closed loop over speed";
  table.columns = {{"speed", "rpm"}, {"damping open", "%"}, {"closed", "%"}, {"growth", "1/s"}};
  for (const shaft::Actuator& a : actuators) {
    table.columns.push_back({"sensitivity " + a.name, ""});
    table.columns.push_back({"turning force", "N"});
  }
  for (const shaft::ControlPoint& p : d.points) {
    std::vector<std::string> row{report::format_fixed(p.speed * kRpmPerRadPerSec, 0),
                                 report::format_number(100 * p.open_damping, 3),
                                 report::format_number(100 * p.closed_damping, 3), report::format_number(p.growth, 3)};
    for (Eigen::Index j = 0; j < p.sensitivity.size(); ++j) {
      row.push_back(p.growth > kGrows
                        ? "unstable"
                        : fmt::format("{:.2f} {}", p.sensitivity[j], shaft::sensitivity_zone(p.sensitivity[j])));
      row.push_back(report::format_number(p.turning_force[j], 3));
    }
    table.add(row);
  }
  session.say(report::to_text(table));
  const bool stable = std::ranges::none_of(d.points, [](const auto& p) { return p.growth > kGrows; });
  if (!stable) return;
  session.say(fmt::format("sensitivity        {:.2f} at most, zone {} of ISO 14839-3 (A below 3, B below 4, C below 5)",
                          d.worst_sensitivity, shaft::sensitivity_zone(d.worst_sensitivity)));
  session.say(fmt::format("turning part       learns at {:.2g} 1/s", d.controller.adaptation));
  session.say(fmt::format("noise              1 um rms of every probe makes up to {:.2g} N rms of force",
                          1e-6 * d.force_noise));
  if (d.refused.empty())
    session.say(
        "stable             at every speed: as designed, with twice the rotating damping, gain +-20 %, one sample more "
        "delay, all modes");
}

void rotor_control(const RotorControlOptions& o, Session& session) {
  if (!(o.to_rpm >= o.from_rpm))
    throw Error::in_field("--to-rpm", fmt::format("{:g}", o.to_rpm), "at or above --from-rpm");
  const shaft::Rotor rotor = shaft::read_rotor(o.rotor);
  shaft::ControlOptions options;
  options.law = o.law;
  options.from = o.from_rpm * kRadPerSecPerRpm;
  options.to = o.to_rpm * kRadPerSecPerRpm;
  options.sample_time = 1 / o.rate_hz;
  options.modes = o.modes;
  options.schedule = o.schedule;
  options.checked = o.points;
  options.sensitivity = o.sensitivity;
  options.adaptation = o.adaptation;
  options.share = o.share / 100;
  options.force_weight = o.force_weight;
  options.unbalance_known = !o.unbalance_unknown;
  shaft::ControlDesign design;
  if (o.controller.empty()) {
    design = shaft::design_rotor_control(rotor, options);
    std::string numbers;
    for (const Amount& number : design.numbers) {
      std::string name = number.name;
      std::ranges::replace(name, '_', ' ');
      numbers += fmt::format(", {} {:.3g}{}{}", name, number.value, number.unit.empty() ? "" : " ", number.unit);
    }
    session.say(fmt::format("feedback           {}, {} states at {:g} Hz{}", design.law, design.controller.states(),
                            o.rate_hz, numbers));
  } else {
    const shaft::RotorController given = shaft::load_rotor_controller(o.controller);
    options.sample_time = given.sample_time;
    design = shaft::check_rotor_control(rotor, given, options);
  }
  say_design(design, session);
  session.result(shaft::control_design_json(design));
  const bool refused = design.summary.status == Status::unusable;
  session.write_together();
  if (!o.out.empty() && !refused) shaft::save_rotor_controller(o.out, design.controller);
  session.finish(design.summary);
}

}  // namespace

void add_rotor_control(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorControlOptions>();
  CommandLine* sub = add_command(
      rotor, session, "control", "Design a controller of all actuators from all probes",
      "Input: a rotor file with [[actuator]] and [[probe]]. Output: feedback at several speeds and force vectors that "
      "turn\n"
      "with the shaft against its unbalance. The controller is refused (exit code 1) where the loop is unstable at any "
      "speed, also\n"
      "with changes of the machine (docs/rotor.md). --out is written only where it is not refused. `whirl export` "
      "makes C\n"
      "or an FMU of it.\n\n"
      "Example: whirl rotor control rotor.toml --from-rpm 100 --to-rpm 9000 --out controller.json",
      [o, &session] { rotor_control(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--from-rpm", o->from_rpm, "lowest speed")->range(0, 1e7)->required();
  sub->add_option("--to-rpm", o->to_rpm, "highest speed")->range(1e-3, 1e7)->required();
  sub->add_option("--law", o->law,
                  "feedback: lqg (all probes and actuators together) or pid (each actuator on its own)")
      ->one_of(shaft::control_laws())
      ->show_default();
  sub->add_option("--rate-hz", o->rate_hz, "samples of the controller a second")->range(1, 1e6)->show_default();
  sub->add_option("--modes", o->modes, "modes of a plane in the model of the controller")
      ->range(1, 100)
      ->show_default();
  sub->add_option("--schedule", o->schedule, "speeds with gains of their own")->range(1, 1000)->show_default();
  sub->add_option("--points", o->points, "speeds at which the loop is looked at")->range(2, 10000)->show_default();
  sub->add_option("--sensitivity", o->sensitivity, "largest peak of the sensitivity")->range(1.1, 100)->show_default();
  sub->add_option("--adaptation-per-s", o->adaptation, "rate at which the turning part learns, 1/s")
      ->range(0, 1e4)
      ->show_default();
  sub->add_option("--share-percent", o->share, "of a force limit that the turning part may take")
      ->range(0, 100)
      ->show_default();
  sub->add_option("--force-weight", o->force_weight, "weight of the turning forces against the readings")
      ->range(0, 100)
      ->show_default();
  sub->add_flag("--unbalance-unknown", o->unbalance_unknown, "the turning part begins at zero");
  sub->add_option("--check", o->controller, "controller to look at on this rotor instead of a new one")->input();
  sub->add_option("--out", o->out, "controller to write (.json)")->output();
}

}  // namespace whirl::app
