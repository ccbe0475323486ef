#include "rotor.hpp"

#include <fmt/format.h>

#include <cctype>

#include "whirl/diagnosis/rotation.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/signals.hpp"

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

std::string column_name(std::string text) {
  for (char& c : text)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return text;
}

TurningRecord load_turning_record(const std::string& file) {
  TurningRecord t{io::read_recording(file, {}), 0, {}};
  const std::optional<diagnosis::Rotation> rotation = diagnosis::rotation_of(t.record);
  if (!rotation) throw Error(file + ": no channel 'key', 'keyphasor', 'tacho' or 'beta' shows a turning shaft");
  t.first = rotation->first;
  t.angle = rotation->angle;
  return t;
}

std::string channel_of(const Recording& record, const std::string& name) {
  for (const std::string& channel : {name, column_name(name)})
    if (record.has(channel)) return channel;
  return "";
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
  add_rotor_run(*rotor, session);
  add_rotor_fit(*rotor, session);
}

}  // namespace whirl::app
