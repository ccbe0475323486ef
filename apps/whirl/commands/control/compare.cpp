#include "whirl/tuning/compare.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "command.hpp"
#include "plant_options.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/output.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/pages/compare_report.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/rig/rig_file.hpp"

namespace whirl::app {
namespace {

// "tsmc, kfe" -> "tsmc_kfe"
std::string file_name(const std::string& label) {
  std::string name;
  for (char c : label) {
    if (c == ' ') continue;
    name += c == ',' ? '_' : c;
  }
  return name;
}

struct CompareFlags {
  PlantOptions plant;
  std::string rig, balanced;
  std::filesystem::path out;
  std::vector<std::string> laws;
  double added_mass_g = 5;
  int seeds = 5;
  bool no_matrix = false;
  tuning::CompareOptions compare;
};

/// Share of the unbalance of a plant file that is left in the balanced case.
constexpr double kBalanced = 0.1;

/// The machine of a plant file to run on: most of its unbalance is a mass that the balanced case takes off.
rig::RigParameters plant_rig(const RotorModel& rotor, const tuning::Hardware& hardware) {
  rig::RigParameters rig = tuning::tuning_plant(rotor, hardware);
  rig.rotor.residual_eccentricity = kBalanced * std::abs(rotor.eps);
  rig.rotor.added_phase = std::arg(rotor.eps);
  rig.rotor.added_mass = (1 - kBalanced) * std::abs(rotor.eps) * rig.rotor.mass / rig.rotor.added_radius;
  return rig;
}

void run_comparison(CompareFlags* o, Session& session) {
  require_range("--added-mass-g", o->added_mass_g, 0, 1000, "g");
  require_range("--seeds", o->seeds, 1, 1000);
  if (!o->out.empty()) {
    session.check_output(o->out / "comparison.json", "whirl.comparison");
    session.check_output(o->out / "report.html");
  }
  std::vector<std::filesystem::path> inputs;
  tuning::CompareOptions& c = o->compare;
  const IdentifiedModel model = o->plant.load(c.design, inputs, identification::Consumer::compare);
  if (!o->laws.empty()) {
    c.methods.clear();
    for (const std::string& law : o->laws) c.methods.push_back(tuning::parse_method(law));
  }
  c.matrix = !o->no_matrix;
  c.seeds.resize(static_cast<std::size_t>(o->seeds));
  for (std::size_t i = 0; i < c.seeds.size(); ++i) c.seeds[i] = 100 + c.design.seed + i;
  rig::RigParameters rig = rig::read_rig(o->rig);
  if (o->plant.is_file() && o->rig.empty()) {
    if (!o->balanced.empty()) throw Error("--balanced: a plant file is compared on itself; give --rig for another");
    rig = plant_rig(*model.rotor, c.design.hardware);
    c.balanced_eps = kBalanced * model.rotor->eps;
  } else {
    rig.rotor.added_mass = 0;
    IdentifiedModel balanced;
    if (o->balanced.empty()) {
      balanced = identification::identify_rotor(rig::record_open_loop(rig).measured);
    } else {
      balanced = io::load<IdentifiedModel>(o->balanced);
      inputs.emplace_back(o->balanced);
    }
    if (balanced.rotor) c.balanced_eps = balanced.rotor->eps;
    rig.rotor.added_mass = o->added_mass_g * 1e-3;
  }
  c.progress = [&](const std::string& label, double fraction) { session.progress("compared " + label, fraction); };

  pages::Comparison comparison;
  comparison.rig = rig;
  comparison.results = compare(model, rig, c);
  const tuning::ComparedResult& best = tuning::best_result(comparison.results);
  comparison.floor = tuning::physical_floor(best.design, rig, c.balanced_eps, c.seeds.front());
  comparison.command_line = session.command_line;
  comparison.provenance = io::provenance(inputs, session.command_line, c.design.seed);

  Summary summary;
  tuning::state_parts(identification::Consumer::compare, model, c.design.hardware, summary);
  if (!best.nominal.stable) {
    summary.fail(fmt::format("no method passes on this rig; {}: {}", best.label, best.nominal.verdict.text()));
  }
  session.say(report::to_text(pages::comparison_table(comparison)));
  if (c.matrix) session.say(report::to_text(pages::failures_table(comparison)));
  session.say(report::to_text(pages::floor_table(comparison)));
  session.say(fmt::format("best: {}", best.label));
  if (!o->out.empty()) {
    io::make_folder(o->out);
    for (const tuning::ComparedResult& r : comparison.results)
      session.check_output(o->out / fmt::format("controller_{}.json", file_name(r.label)), "whirl.controller");
    session.write_together();
    for (const tuning::ComparedResult& r : comparison.results) {
      io::save(o->out / fmt::format("controller_{}.json", file_name(r.label)), r.design);
    }
    io::save_json(o->out / "comparison.json", to_json(comparison).set("summary", to_json(summary)));
    report::write_html(pages::comparison_report(comparison), o->out / "report.html", true);
    session.say("report: " + (o->out / "report.html").string());
  }
  session.result(to_json(comparison).set("summary", to_json(summary)));
  session.finish(summary);
}

}  // namespace

void add_compare(CommandLine& app, Session& session) {
  auto o = std::make_shared<CompareFlags>();
  CommandLine* sub = add_command(
      app, session, "compare", "All control laws on the same rig, runs and seeds, beside the paper's numbers",
      "Input: model.json identified on the rotor to be controlled; its mass by --stiffness or --mass-kg. Every law is "
      "tuned on\n"
      "the identified model with the same budget and then run on the simulated rig: segments of paper Table 4, "
      "balanced "
      "case\n"
      "(Fig. 18; the balanced rotor is run and identified too, or give --balanced model_balanced.json), effort, "
      "robustness\n"
      "matrix, physical floor.\n"
      "Output: table; --out DIR writes report.html, comparison.json and controller_LAW_ESTIMATOR.json.\n\n"
      "Example: whirl compare model.json --stiffness stiffness.json --modes modes.json --out out/compare\n"
      "         whirl compare model.json --mass-kg 1.5 --laws tsmc pd:lpf:no-feedforward lsmc:kfe",
      [o, &session] { run_comparison(o.get(), session); });
  sub->add_option("MODEL", o->plant.model, "model.json, a plant file (whirl.plant, docs/formats.md) or an FMU")
      ->input()
      ->required();
  sub->add_option("--out", o->out, "folder for the report and the controllers")->output_folder();
  sub->add_option(
      "--laws", o->laws,
      "LAW, LAW:ESTIMATOR or LAW:ESTIMATOR:no-feedforward, several; default: all laws and the estimators worth it");
  o->plant.add_to(sub);
  sub->add_option("--rig", o->rig, "TOML with rig parameters that differ from the default")->input();
  sub->add_option("--added-mass-g", o->added_mass_g, "screw in the disk")->range(0, 1000)->show_default();
  sub->add_option("--balanced", o->balanced, "model.json identified on the balanced rotor")->input();
  sub->add_option("--evaluations", o->compare.design.evaluations, "tuning budget, the same for every law")
      ->range(1, 1e6)
      ->show_default();
  sub->add_option("--seeds", o->seeds, "runs with different sensor noise per method")->range(1, 1000)->show_default();
  sub->add_option("--seed", o->compare.design.seed, "of the tuning; the runs take others")->show_default();
  sub->add_option("--threads", o->compare.design.threads, "0: all cores; the result does not depend on it")
      ->range(0, 1024)
      ->show_default();
  sub->add_flag("--no-matrix", o->no_matrix, "leave the robustness matrix out");
}

}  // namespace whirl::app
