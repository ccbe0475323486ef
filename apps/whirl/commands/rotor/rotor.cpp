#include "rotor.hpp"

#include <fmt/format.h>

#include "whirl/io/file.hpp"
#include "whirl/shaft/rotor_json.hpp"

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

struct ImportOptions {
  std::string file, out;
};

void add_rotor_import(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<ImportOptions>();
  CommandLine* sub = add_command(
      rotor, session, "import", "A rotor file from a rotor that ROSS saved",
      "Input: TOML of Rotor.save(). Output: the rotor file, with the elements and the shear rule of ROSS, so that the\n"
      "frequencies agree. What a rotor file cannot hold is refused by its name (docs/rotor.md).\n\n"
      "Example: whirl rotor import compressor.toml --out rotor.toml",
      [o, &session] {
        const shaft::ImportedRotor imported = shaft::import_ross_rotor(o->file);
        Summary summary;
        for (const std::string& remark : imported.remarks) summary.warn(remark);
        io::write_text(o->out, shaft::rotor_text(imported.rotor));
        const shaft::Rotor& r = imported.rotor;
        session.say(fmt::format("{}: {:.4g} m, {:.4g} kg; sections {}, discs {}, bodies {}, bearings and mounts {}",
                                o->out, r.length(), r.mass(), r.sections.size(), r.discs.size(), r.bodies.size(),
                                r.supports.size()));
        session.result(shaft::import_json(imported, summary));
        session.finish(summary);
      });
  sub->add_option("FILE", o->file, "rotor that ROSS saved (.toml)")->input()->required();
  sub->add_option("--out", o->out, "rotor file to write (.toml)")->output()->required();
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
  add_rotor_import(*rotor, session);
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
