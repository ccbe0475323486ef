#include "rotor.hpp"

#include <fmt/format.h>

#include "whirl/io/file.hpp"

namespace whirl::app {
namespace {

struct NewRotorOptions {
  std::string name = "two-disc", out;
};

void add_rotor_new(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<NewRotorOptions>();
  CommandLine* sub =
      add_command(rotor, session, "new", "Write a rotor file to begin with",
                  "Output: TOML with comments; docs/rotor.md lists every key. Without --out it is printed.\n\n"
                  "Example: whirl rotor new --template centrifuge --out rotor.toml",
                  [o, &session] {
                    const std::string text = shaft::rotor_template(o->name);
                    if (o->out.empty()) {
                      fmt::print("{}", text);
                      return;
                    }
                    io::write_text(o->out, text);
                    session.say(fmt::format("{}: {}", o->out, o->name));
                  });
  sub->add_option("--template", o->name, "rotor to begin with")->one_of(shaft::rotor_templates())->show_default();
  sub->add_option("--out", o->out, "TOML file to write")->output();
}

}  // namespace

LoadedRotor load_rotor(const std::string& file) {
  LoadedRotor loaded{shaft::read_rotor(file), {}};
  loaded.system = shaft::assemble(loaded.rotor);
  return loaded;
}

std::string whirl_word(double direction) {
  return direction > 0.8 ? "forward" : direction < -0.8 ? "backward" : "mixed";
}

void add_rotor(CommandLine& app, Session& session) {
  CommandLine* rotor = app.add_subcommand("rotor", "Flexible rotors: shaft, discs, bearings, mounts from a rotor file");
  rotor->require_subcommand();
  rotor->footer(
      "A rotor file (TOML) holds the geometry of the shaft, discs, bearings with stiffness and damping, unbalance and\n"
      "probes. Modes, critical speeds, unbalance response and runs follow from it by finite elements "
      "(docs/rotor.md).\n\n"
      "Example: whirl rotor new --template two-disc --out rotor.toml && whirl rotor modes rotor.toml --speed-rpm 3000");
  add_rotor_new(*rotor, session);
  add_rotor_modes(*rotor, session);
  add_rotor_campbell(*rotor, session);
  add_rotor_criticals(*rotor, session);
  add_rotor_response(*rotor, session);
  add_rotor_control(*rotor, session);
  add_rotor_run(*rotor, session);
  add_rotor_fit(*rotor, session);
  add_rotor_trend(*rotor, session);
  add_rotor_which(*rotor, session);
}

}  // namespace whirl::app
