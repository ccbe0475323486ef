#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "command.hpp"
#include "plant_options.hpp"
#include "ranks.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/hash.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/output.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/pages/monte_carlo_report.hpp"
#include "whirl/report/document.hpp"
#include "whirl/tuning/monte_carlo.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::app {

namespace {

struct RobustnessOptions {
  PlantOptions plant;
  std::string controller;
  std::filesystem::path out;
  double limit_mm = 0;
  tuning::MonteCarloOptions study;
};

/// What the probability does not cover: how far the structure of the model is from the machine's.
void say_structure(const Session& session, double left, Summary& summary) {
  constexpr double kMuch = 0.05;
  if (std::isnan(left)) {
    return session.say(
        "The probability covers machines of the model's structure; the model does not say what it leaves "
        "of a held-out record.");
  }
  const std::string part =
      fmt::format("the model leaves {:.1f} % (rms) of its held-out motion unexplained", 100 * left);
  if (left < kMuch) {
    return session.say(fmt::format("The probability covers machines of the model's structure; {}.", part));
  }
  summary.warn(part +
               ": the structure of the machine is another one, and the probability and its interval do not hold "
               "for it");
}

/// What made the design unusable makes this study so: it judges no other controller.
void take_verdict(const Summary& design, Summary& summary) {
  if (design.status != Status::unusable) return;
  bool said = false;
  for (const Finding& f : design.findings) {
    if (f.consequence != Consequence::unusable) continue;
    summary.add(f);
    said = true;
  }
  if (!said) summary.fail("the design: " + design.reason);
}

void run_study(RobustnessOptions* o, Session& session) {
  const MpiRanks mpi;
  const tuning::Ranks& ranks = mpi.ranks();
  try {
    if (!o->out.empty() && ranks.rank == 0) {
      session.check_output(o->out / "robustness.json", "whirl.robustness");
      session.check_output(o->out / "report.html");
    }
    tuning::DesignOptions d;
    std::vector<std::filesystem::path> inputs{o->controller};
    IdentifiedModel model = o->plant.load(d, inputs, identification::Consumer::robustness);
    if (d.gain > 0 && model.rotor) model.rotor->gain = d.gain;
    const ControllerDesign design = io::load<ControllerDesign>(o->controller);
    tuning::MonteCarloOptions& study = o->study;
    require_range("--limit-mm", o->limit_mm, 0, 1000, "mm");
    study.limit = 1e-3 * o->limit_mm;
    for (const auto& input : inputs) study.key += io::sha256_file(input);
    if (!o->plant.hardware.empty()) study.key += io::sha256_file(o->plant.hardware);
    study.key += fmt::format(" mass {:a}", o->plant.mass_kg);
    const auto start = std::chrono::steady_clock::now();
    long first = -1;  // what the checkpoint held does not count as speed
    double speed = 0;
    study.progress = [&](long done, long samples) {
      const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (first < 0) first = done;
      speed = static_cast<double>(done - first) / s;
      session.progress("robustness", static_cast<double>(done) / static_cast<double>(samples));
    };
    const tuning::MonteCarloResult result = tuning::monte_carlo(design, model, d.hardware, study, ranks);
    if (ranks.rank != 0) return;
    const Provenance from =
        io::provenance(inputs, fmt::format("samples {} limit {} mm", study.samples, o->limit_mm), study.seed);
    session.say(report::to_text(pages::monte_carlo_table(result, study)));
    if (speed > 0) {
      session.say(fmt::format("{:.0f} machines/s with {} process{} of {} thread{}, {} lanes", speed, ranks.size,
                              ranks.size == 1 ? "" : "es", study.threads > 0 ? fmt::format("{}", study.threads) : "all",
                              study.threads == 1 ? "" : "s", study.lanes));
    }
    Summary summary;
    tuning::state_parts(identification::Consumer::robustness, model, d.hardware, summary);
    say_structure(session, o->plant.is_fmu() ? std::nan("") : identification::load_left_unexplained(o->plant.model),
                  summary);
    take_verdict(design.summary, summary);
    if (const std::string low = tuning::margin_shortfall(design); !low.empty()) {
      summary.fail("the margins of the design: " + low);
    }
    if (result.stable.high < tuning::kEnoughPass) {
      summary.fail(
          fmt::format("{:.1f} % of the machines fail the acceptance limits, at least {:.1f} % with 95 % confidence",
                      100 * (1 - result.stable.value), 100 * (1 - result.stable.high)));
    }
    const io::Json json =
        pages::to_json(result, study).set("summary", to_json(summary)).set("provenance", to_json(from));
    if (!o->out.empty()) {
      io::make_folder(o->out);
      session.write_together();
      io::save_json(o->out / "robustness.json", json);
      report::write_html(pages::monte_carlo_report(result, study, design, from), o->out / "report.html", true);
      session.say("report: " + (o->out / "report.html").string());
    }
    session.result(json);
    session.finish(summary);
  } catch (const std::exception& e) {
    if (ranks.size > 1) {
      fmt::print(stderr, "whirl: error: rank {}: {}\n", ranks.rank, e.what());
      mpi.abort(2);
    }
    throw;
  }
}

/// What the machines are drawn with.
void add_draws(CommandLine* sub, tuning::MonteCarloOptions& study) {
  sub->add_option("--covariance-scale", study.covariance_scale, "factor on the identified standard deviations")
      ->range(0, 1e3)
      ->show_default();
  sub->add_option("--stiffness-sd", study.stiffness_sd, "further relative standard deviation of k1")
      ->range(0, 1)
      ->show_default();
  sub->add_option("--damping-sd", study.damping_sd, "of c")->range(0, 10)->show_default();
  sub->add_option("--unbalance-sd", study.unbalance_sd, "of the unbalance, size and angle")
      ->range(0, 10)
      ->show_default();
  sub->add_option("--sheet-sd", study.sheet_sd,
                  "of what the data sheet states of sensors (low-pass, hysteresis) and actuators (bandwidth, current "
                  "limit, slew, hysteresis), relative")
      ->range(0, 0.5)
      ->show_default();
  sub->add_option("--runout-sd", study.runout_sd, "of each runout harmonic, relative, machine by machine")
      ->range(0, 3)
      ->show_default();
  sub->add_option("--runout-common", study.runout_common, "of its logarithm, all machines alike")
      ->range(0, 3)
      ->show_default();
  sub->add_flag("--other-machines", study.other_machines,
                "other machines of the make: an unbalance of any angle and a runout of its own on each, under the "
                "controller's table; without it the machine that was identified");
  sub->add_option("--participation-sd", study.participation_sd, "of the participation of structural modes, relative")
      ->range(0, 3)
      ->show_default();
  sub->add_option("--ringing", study.ringing,
                  "of the structure at the start: velocity of each mode / (eccentricity * top speed)")
      ->range(0, 3)
      ->show_default();
}

}  // namespace

void add_robustness(CommandLine& app, Session& session) {
  auto o = std::make_shared<RobustnessOptions>();
  CommandLine* sub = add_command(
      app, session, "robustness",
      "Chance that a controller keeps the displacement below a limit, given the uncertainty of the model",
      "Input: controller.json, and the model.json it was designed on with --stiffness or --mass-kg, --modes, "
      "--hardware as in\n"
      "`whirl design`. Rotors are drawn from the covariance of the identification and from tolerances of the hardware, "
      "with\n"
      "other runout phases and sensor noise each; the controller stays as it is. Beside the tolerances below: actuator "
      "gain\n"
      "3 %, axes 1.1 degrees, stiffness of the axes of the shaft 1 % apart. What all machines may have in common and "
      "no "
      "data\n"
      "sheet says (tails of the tolerances or limits, runout, a structure that rings) is drawn one way for half of "
      "them, "
      "and\n"
      "the other for the rest; the difference widens the interval.\n"
      "Output: distribution of the whole-run peak (zero-to-peak, true disk centre, x axis), fraction stable, and the "
      "probability\n"
      "of exceeding --limit-mm with its 95 % interval (Clopper-Pearson). Fails (exit code 1) where surely more than 5 "
      "% of "
      "the\nmachines fail the acceptance limits of `whirl run`, the margins of the design are too small or `design` "
      "called the\ncontroller unusable; --out DIR "
      "writes "
      "robustness.json and "
      "report.html.\n"
      "The numbers depend on --seed alone, not on lanes, threads or processes. With --checkpoint a killed study goes "
      "on where\n"
      "it was when the same command is given again.\n\n"
      "Example: whirl robustness controller.json model.json --mass-kg 1.5 --samples 2000 --limit-mm 0.03\n"
      "         mpirun -n 4 whirl robustness controller.json model.json --mass-kg 1.5 --samples 100000 --checkpoint "
      "study.txt",
      [o, &session] { run_study(o.get(), session); });
  sub->add_option("CONTROLLER", o->controller, "controller.json")->input()->required();
  sub->add_option("MODEL", o->plant.model, "model.json, a plant file (whirl.plant, docs/formats.md) or an FMU")
      ->input()
      ->required();
  o->plant.add_to(sub);
  sub->add_option("--samples", o->study.samples, "machines drawn")->show_default();
  sub->add_option("--seed", o->study.seed, "of the draws")->show_default();
  sub->add_option("--limit-mm", o->limit_mm, "displacement not to be exceeded, zero-to-peak; 0: none")
      ->range(0, 1000)
      ->show_default();
  add_draws(sub, o->study);
  sub->add_option("--checkpoint", o->study.checkpoint, "file of finished samples; an existing one is continued")
      ->output("text");
  sub->add_option("--lanes", o->study.lanes, "rigs side by side in vector registers: 8, 16 or 32")->show_default();
  sub->add_option("--threads", o->study.threads, "per process; 0: all cores, shared among the processes")
      ->range(0, 1024)
      ->show_default();
  sub->add_option("--out", o->out, "folder for robustness.json and report.html")->output_folder();
}

}  // namespace whirl::app
