#include <fmt/format.h>

#include "rotor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/rotor_json.hpp"

namespace whirl::app {
namespace {

struct RotorCriticalsOptions {
  std::string rotor;
  double to_rpm = 0, order = 1;
};

void rotor_criticals(const RotorCriticalsOptions& o, Session& session) {
  const LoadedRotor loaded = load_rotor(o.rotor);
  const double highest = o.to_rpm * kRadPerSecPerRpm;
  const std::vector<shaft::Critical> found = shaft::criticals(loaded.system, highest, 1 / o.order);
  const auto threshold = shaft::stability_threshold(loaded.system, highest / 1000, highest);
  report::Table table;
  table.caption = fmt::format("critical speeds of an excitation {:g} times a turn", o.order);
  table.columns = {{"critical", ""}, {"speed", "rpm"}, {"frequency", "Hz"}, {"whirl", ""}};
  for (std::size_t k = 0; k < found.size(); ++k)
    table.add({std::to_string(k + 1), report::format_fixed(found[k].speed / kRadPerSecPerRpm, 1),
               report::format_fixed(found[k].frequency / kTwoPi, 3), whirl_word(found[k].direction)});
  session.say(found.empty() ? fmt::format("no critical speed up to {:g} rpm", o.to_rpm) : report::to_text(table));
  session.say(threshold ? fmt::format("unstable           from {:.5g} rpm: {} whirl at {:.4g} Hz grows",
                                      threshold->speed / kRadPerSecPerRpm, whirl_word(threshold->direction),
                                      threshold->frequency / kTwoPi)
                        : fmt::format("stable             up to {:g} rpm", o.to_rpm));
  session.result(shaft::criticals_json(found, 1 / o.order, threshold, highest));
}

}  // namespace

void add_rotor_criticals(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorCriticalsOptions>();
  CommandLine* sub =
      add_command(rotor, session, "criticals", "Critical speeds, and the speed above which the rotor is unstable",
                  "Input: a rotor file. Critical speeds are those of the undamped rotor, found directly and not from a "
                  "diagram. Unbalance\n"
                  "excites those of forward whirl, and of backward whirl where the bearings differ between x and y.\n\n"
                  "Example: whirl rotor criticals rotor.toml --to-rpm 20000",
                  [o, &session] { rotor_criticals(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--to-rpm", o->to_rpm, "highest speed")->range(1e-3, 1e7)->required();
  sub->add_option("--order", o->order, "excitation a turn: 1 unbalance, 2 e.g. a coupling")
      ->range(1e-3, 1000)
      ->show_default();
}

}  // namespace whirl::app
