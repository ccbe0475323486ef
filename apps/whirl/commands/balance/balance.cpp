#include "balance.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <set>

#include "balance_job.hpp"
#include "commands/control/plant_options.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/diagnosis/balancing.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/identify/parts/readings.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/pages/steady_response.hpp"

namespace whirl::app {
namespace {

struct ModelOptions {
  PlantOptions plant;
  double radius_mm = 0, speed_rpm = 0, grade = 0;
};

/// Makes the intervals of `a` hold the advice by another reading of the records.
void cover(const diagnosis::BalancingAdvice& other, diagnosis::BalancingAdvice& a) {
  const auto interval = [](const std::optional<Estimate>& e, double value) {
    return e ? *e : Estimate::from_sd(value, 0);
  };
  const auto widen = [](Estimate& e, double low, double high) {
    e.low = std::min(e.low, low);
    e.high = std::max(e.high, high);
  };
  if (!a.mass_interval) a.mass_interval = interval({}, a.correction_mass);
  if (!a.angle_interval) a.angle_interval = interval({}, a.correction_angle);
  const Estimate mass = interval(other.mass_interval, other.correction_mass),
                 angle = interval(other.angle_interval, other.correction_angle);
  widen(*a.mass_interval, mass.low, mass.high);
  const double turn = std::remainder(other.correction_angle - a.correction_angle, 2 * std::numbers::pi) -
                      (other.correction_angle - a.correction_angle);
  widen(*a.angle_interval, angle.low + turn, angle.high + turn);
}

void balance_from_model(const ModelOptions& o, Session& session) {
  if (!(o.radius_mm > 0)) throw Error("--radius-mm is needed: where the mass is added");
  if (!(o.speed_rpm > 0)) throw Error("--speed-rpm is needed: the service speed");
  tuning::DesignOptions design;
  std::vector<std::filesystem::path> inputs;
  const IdentifiedModel model = o.plant.load(design, inputs, identification::Consumer::balance);
  if (!model.rotor) throw Error(o.plant.model + ": the model has no rotor parameters; identify with --method weak");
  Summary summary = model.summary;
  take_parts(identification::Consumer::balance, model, summary, o.plant.model);
  const double grade = o.grade > 0 ? o.grade : 6.3;
  const double mass = 1 / (design.gain > 0 ? design.gain : model.rotor->gain);
  const double omega = o.speed_rpm * std::numbers::pi / 30;
  const auto advice = [&](const IdentifiedModel& m) {
    return diagnosis::balancing_advice(*m.rotor, mass, o.radius_mm * 1e-3, omega, grade, m.rotor_covariance);
  };
  diagnosis::BalancingAdvice a = advice(model);
  for (const identification::ModelReading& reading : identification::other_readings(model, true))
    cover(advice(reading.model), a);
  session.say(fmt::format("unbalance          {:.4g} g mm, heavy spot at {:.1f} deg", 1e6 * a.unbalance,
                          a.heavy_angle / kRadPerDegree));
  session.say(fmt::format("balance quality    G {:.3g} at {:g} rpm; G {:g} required: {}", a.grade, o.speed_rpm, grade,
                          a.within_grade ? "held, nothing to do" : "not held"));
  session.say(fmt::format("permitted          {:.4g} g mm", 1e6 * a.permitted_unbalance));
  session.say(fmt::format("to add             {:.3g} g at {:g} mm and {:.1f} deg", 1e3 * a.correction_mass, o.radius_mm,
                          a.correction_angle / kRadPerDegree));
  if (a.mass_interval && !(a.mass_interval->low > 0)) {
    session.say(fmt::format("95 % interval      0 to {:.3g} g at any angle: not different from zero",
                            1e3 * a.mass_interval->high));
  } else if (a.mass_interval) {
    session.say(fmt::format("95 % interval      {:.3g} to {:.3g} g, {:.1f} to {:.1f} deg (a given mass of the disk)",
                            1e3 * a.mass_interval->low, 1e3 * a.mass_interval->high,
                            a.angle_interval->low / kRadPerDegree, a.angle_interval->high / kRadPerDegree));
  }
  io::Json json = io::Json::object();
  json.set("unbalance_kg_m", a.unbalance)
      .set("heavy_angle_rad", a.heavy_angle)
      .set("correction_mass_kg", a.correction_mass)
      .set("correction_radius_m", o.radius_mm * 1e-3)
      .set("correction_angle_rad", a.correction_angle)
      .set("grade_mm_s", a.grade)
      .set("permitted_unbalance_kg_m", a.permitted_unbalance)
      .set("within_grade", a.within_grade);
  if (a.mass_interval) {
    json.set("correction_mass", to_json(*a.mass_interval, "kg"))
        .set("correction_angle", to_json(*a.angle_interval, "rad"));
  }
  if (a.correction_mass > 0.05 * mass) {
    summary.fail(
        fmt::format("the mass to add is {:.3g} % of the disk's: is --radius-mm = {:g} a radius in m, or the mass in g?",
                    100 * a.correction_mass / mass, o.radius_mm));
  }
  if (std::string doubt = pages::doubt_of_hertz("--speed-rpm", omega, omega, model.rotor->natural_frequency());
      !doubt.empty())
    summary.warn(std::move(doubt));
  session.result(json.set("summary", to_json(summary)));
  session.finish(summary);
}

}  // namespace

void add_balance(CommandLine& app, Session& session) {
  auto model = std::make_shared<ModelOptions>();
  auto job = std::make_shared<JobFlags>();
  auto guided = std::make_shared<GuidedFlags>();
  CommandLine* sub = add_command(
      app, session, "balance", "Masses and angles to add: from balancing runs, or from an identified model",
      "Input: a job of balancing runs (runs.csv or runs.toml), or model.json of `whirl identify`.\n"
      "runs.csv has one row a run and speed: run_1, speed_rpm, PROBE_amp_um, PROBE_phase_deg, PLANE_mass_gram,\n"
      "PLANE_angle_deg for any number of probes and planes. The masses are all that is on the rotor in that run beyond "
      "its\n"
      "state as found. runs.toml: see docs/balancing.md. Say how vectors are written: --phase lag|lead, --amplitude\n"
      "peak|pp|rms, --angles with|against the rotation. A run that contradicts the others is named and left out.\n"
      "Without PROBE_phase_deg columns the job is balanced from amplitudes alone (four runs or more).\n"
      "A model needs --radius-mm, --speed-rpm and the disk's mass (--mass-kg or --stiffness); one plane. The grade is\n"
      "G = e omega at the service speed (ISO 21940-11: 2.5 for turbines and pumps of high quality, 6.3 general "
      "machines).\n\n"
      "Example: whirl balance runs.csv --phase lag --angles against --amplitude pp --page sheet.html\n"
      "With --session the runs of a job are kept in one file and the next run to make is printed: which plane, what "
      "mass "
      "at\n"
      "which angle, and why; it ends with the correction, its check and the sheet.\n"
      "Example: whirl balance model.json --mass-kg 1.5 --radius-mm 83 --speed-rpm 1800\n"
      "Example: whirl balance --session fan.toml --planes A,B --probes DE,NDE --speeds-rpm 1500 --phase lag \\\n"
      "  --amplitude pp --angles against --trial-gram 10 --target-um 20\n"
      "         whirl balance --session fan.toml --readings \"48.3@8 47.3@60\"",
      [model, job, guided, &session] {
        job->mass_kg = model->plant.mass_kg;
        job->radius_mm = model->radius_mm;
        job->speed_rpm = model->speed_rpm;
        job->grade = model->grade;
        if (guided->file.empty() == model->plant.model.empty())
          throw Error("one of INPUT (runs.csv, runs.toml, model.json) and --session FILE is needed");
        if (!guided->file.empty())
          balance_session(*guided, *job, session);
        else if (model->plant.model.ends_with(".json")) {
          for (const std::string& flag : session.command->given_flags()) {
            static const std::set<std::string> ours{"--mass-kg", "--stiffness", "--radius-mm", "--speed-rpm",
                                                    "--grade"};
            if (!ours.contains(flag) && flag != "--json" && flag != "--quiet" && flag != "--force")
              throw Error(flag + " is for balancing runs; a model takes " + fmt::format("{}", fmt::join(ours, ", ")));
          }
          balance_from_model(*model, session);
        } else
          balance_runs(model->plant.model, *job, session);
      });
  sub->add_option("INPUT", model->plant.model, "runs.csv, runs.toml or model.json")->input();
  guided->add_to(sub);
  job->add_to(sub);
  sub->add_option("--mass-kg", model->plant.mass_kg, "mass of the disk (model) or rotor (runs)")->range(0, 1e9);
  sub->add_option("--stiffness", model->plant.stiffness,
                  "model: stiffness.json of the static stiffness test, gives the mass")
      ->input()
      ->excludes("--mass-kg");
  sub->add_option("--radius-mm", model->radius_mm, "where the mass is added")->range(0, 1e6);
  sub->add_option("--speed-rpm", model->speed_rpm, "service speed; runs: the highest speed")->range(0, 1e6);
  sub->add_option("--grade", model->grade, "required balance quality, mm/s [model: 6.3]")->range(0, 1e5);
}

}  // namespace whirl::app
