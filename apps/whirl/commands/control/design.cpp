#include "whirl/tuning/design.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "command.hpp"
#include "plant_options.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/pages/text/design.hpp"
#include "whirl/report/table.hpp"
#include "whirl/tuning/law_file.hpp"

namespace whirl::app {
namespace {

constexpr const char* kOwnLaw = "state_space";

void list_methods(const Session& session) {
  for (const auto& [title, methods] :
       {std::pair{"laws", &control::laws()}, std::pair{"estimators", &control::estimators()}}) {
    report::Table table;
    table.caption = title;
    table.columns = {{"name", "", report::Align::left},
                     {"what it is", "", report::Align::left},
                     {"source", "", report::Align::left}};
    for (const control::MethodInfo& m : *methods) table.add({m.name, m.title, m.source});
    session.say(report::to_text(table));
  }
}

// "kd=5" -> {"kd", 5}
std::map<std::string, double> parse_fixed(const std::vector<std::string>& settings) {
  std::map<std::string, double> fixed;
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    char* end = nullptr;
    const double value = equals == std::string::npos ? 0 : std::strtod(setting.c_str() + equals + 1, &end);
    if (equals == std::string::npos || *end != '\0' || end == setting.c_str() + equals + 1) {
      throw Error::in_field("--set", setting, "NAME=NUMBER, e.g. kd=5");
    }
    fixed[setting.substr(0, equals)] = value;
  }
  return fixed;
}

/// A file is the law; without one its numbers are set by hand.
void choose_own(const std::string& file, tuning::DesignOptions& d) {
  if (!file.empty()) d.law = kOwnLaw;
  if (file.empty() && d.law == kOwnLaw && d.fixed.empty())
    throw Error::in_field("--law", d.law, "given by its numbers: --law-file law.json (docs/formats.md)");
}

void read_own(const std::string& file, tuning::DesignOptions& d, std::vector<std::filesystem::path>& inputs) {
  if (file.empty()) return;
  d.inputs.own = tuning::read_law(io::load_json(file), file, 1 / d.hardware.timing.rate);
  inputs.emplace_back(file);
}

}  // namespace

void add_design(CommandLine& app, Session& session) {
  struct Options {
    PlantOptions plant;
    std::string out, law_file;
    tuning::DesignOptions design;
    std::string slow_roll;
    bool no_feedforward = false, list = false;
    std::vector<std::string> set;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "design", "A controller tuned on the identified model",
      "Input: model.json, and the mass that turns forces into accelerations: --mass-kg, or --stiffness stiffness.json\n"
      "(mass = K1 of the static stiffness test / k1 of the model). --hardware: data sheets of sensors, converters and "
      "actuators as "
      "TOML\n"
      "(the laser, actuator, encoder, timing and profile tables of `whirl rig parameters`).\n"
      "Every law gets the same tuning budget on the same scenarios; the tuning plant is the identified model alone.\n"
      "Output: requirements with value, limit and whether they are met: margins of the loop, vibration of the nominal "
      "run,\n"
      "of a typical machine and of 95 % of the machines that the model allows, eq. 42 of the paper, certificate.\n\n"
      "Example: whirl design model.json --stiffness stiffness.json --law tsmc --out controller.json",
      [o, &session] {
        if (o->list) return list_methods(session);
        if (o->plant.model.empty()) throw Error("design needs a model.json (or --list)");
        tuning::DesignOptions d = o->design;
        d.feedforward = !o->no_feedforward;
        d.fixed = parse_fixed(o->set);
        choose_own(o->law_file, d);
        std::vector<std::filesystem::path> inputs;
        const IdentifiedModel model = o->plant.load(d, inputs, identification::Consumer::design);
        read_own(o->law_file, d, inputs);
        if (!o->slow_roll.empty()) {
          d.hardware.slow_roll = control::estimate_runout(io::read_recording(o->slow_roll));
          inputs.emplace_back(o->slow_roll);
        }
        d.progress.tuning = [&](const tuning::DesignProgress& p) {
          if (p.evaluation % 10 == 0 || p.evaluation == p.budget) {
            session.progress(fmt::format("tuning {}, best objective {:.4f}", d.law, p.best),
                             // A search that starts again may look beyond its budget.
                             std::min(1.0, static_cast<double>(p.evaluation) / static_cast<double>(p.budget)));
          }
        };
        d.progress.training = [&](double done) { session.progress(fmt::format("training {}", d.law), done); };
        ControllerDesign result = tuning::design(model, d);
        result.provenance = io::provenance(inputs, session.command_line, d.seed);
        if (o->plant.is_fmu()) say_on_fmu(session, o->plant, d.hardware, result, result.summary);
        if (!o->out.empty()) io::save(o->out, result);
        session.say(report::to_text(pages::requirements_table(result)));
        if (o->out.empty()) session.say(report::to_text(pages::parameters_table(result)));
        session.result(to_json(result));
        session.finish(result.summary);
      });
  sub->add_option("MODEL", o->plant.model, "model.json, a plant file (whirl.plant, docs/formats.md) or an FMU")
      ->input();
  sub->add_option("--out", o->out, "write controller.json")->output("whirl.controller");
  sub->add_option("--law", o->design.law, "control law; --list names all")->show_default();
  sub->add_option("--law-file", o->law_file,
                  "a law of your own (whirl.law, docs/formats.md): A, B, C, D or num, den; the search tunes only the "
                  "estimator then")
      ->input()
      ->excludes("--law");
  sub->add_option("--estimator", o->design.estimator, "state estimator; --list names all")->show_default();
  sub->add_flag("--no-feedforward", o->no_feedforward, "leave the unbalance term of f2, f4 out");
  o->plant.add_to(sub);
  sub->add_option("--set", o->set, "fix a parameter instead of tuning it, NAME=NUMBER");
  sub->add_option("--slow-roll", o->slow_roll,
                  "record x, y, beta turning far below the critical speed: its runout, 1x to 5x, is removed")
      ->input();
  sub->add_option("--evaluations", o->design.evaluations, "tuning budget, the same for every law")
      ->range(1, 1e6)
      ->show_default();
  sub->add_option("--training-runs", o->design.inputs.training_runs,
                  "runs on random machines for the weights of --law learned; 0: 48 for each evaluation")
      ->range(0, 1e8)
      ->show_default();
  sub->add_option("--seed", o->design.seed, "of the search and of the sensor noise while tuning")->show_default();
  sub->add_flag("--list", o->list, "list the laws and estimators");
}

}  // namespace whirl::app
