#include "plant_options.hpp"

#include <fmt/format.h>

#include "commands/machine/run_fmu.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/fmu_loop.hpp"
#include "whirl/deploy/fmu_survey.hpp"
#include "whirl/io/json.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/frf.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/tuning/plant_file.hpp"

namespace whirl::app {

void PlantOptions::add_to(CommandLine* sub) {
  sub->add_option("--mass-kg", mass_kg, "mass of the disk")->positive();
  sub->add_option("--stiffness", stiffness, "stiffness.json of the static stiffness test: gives the mass")
      ->input()
      ->excludes("--mass-kg");
  sub->add_option("--modes", modes, "modes.json of the hammer test: the tuning plant gets these modes")->input();
  sub->add_option("--hardware", hardware,
                  "TOML with the data sheets; default: those of the simulated rig. [modes.N] frequency_hz, "
                  "damping_percent, participation and sensor_sign (0: not known): structural modes that are known")
      ->input();
  sub->add_option("--fmu-name", fmu_names,
                  "MODEL an FMU: its variable for a role, e.g. x=rotor.x; roles x, y, ux, uy, beta, omega, alpha");
}

namespace {

/// A plant that another program modelled (whirl.plant) has its gain and its structure in its file.
IdentifiedModel of_plant(const PlantOptions& o, const io::Json& document, tuning::DesignOptions& design,
                         std::vector<std::filesystem::path>& inputs) {
  if (!o.stiffness.empty() || o.mass_kg > 0 || !o.modes.empty()) {
    throw Error(o.model + ": a plant file says mass and modes itself; leave --stiffness, --mass-kg and --modes out");
  }
  const tuning::LinearPlant plant = tuning::read_plant(document, o.model);
  IdentifiedModel out;
  out.method = "plant file";
  out.rotor = plant.rotor;
  design.hardware = tuning::data_sheet(rig::read_rig(o.hardware));
  design.hardware.modes = tuning::known_modes(plant.structure, rig::read_modes(o.hardware));
  inputs.emplace_back(o.model);
  return out;
}

deploy::FmuPlantOptions fmu_options(const PlantOptions& o, const tuning::Hardware& hardware) {
  return {hardware.profile.without_ripple(), 1 / hardware.timing.rate, fmu_names(o.fmu_names)};
}

/// A plant that only answers: measured as a laboratory would.
IdentifiedModel of_fmu(const PlantOptions& o, tuning::DesignOptions& design,
                       std::vector<std::filesystem::path>& inputs) {
  if (!o.stiffness.empty() || o.mass_kg > 0 || !o.modes.empty()) {
    throw Error(o.model + ": an FMU is pulled and hit by whirl itself; leave --stiffness, --mass-kg and --modes out");
  }
  design.hardware = tuning::data_sheet(rig::read_rig(o.hardware));
  const deploy::FmuSurvey survey =
      deploy::survey_fmu(o.model, fmu_options(o, design.hardware), std::max(design.hardware.laser.noise, 1e-9));
  const ModalModel modes = modal::fit_modes(modal::estimate_frf({survey.blow}));
  design.hardware.modes = tuning::known_modes(tuning::structure_modes(modes, survey.model.rotor->natural_frequency()),
                                              rig::read_modes(o.hardware));
  inputs.emplace_back(o.model);
  return survey.model;
}

}  // namespace

bool PlantOptions::is_fmu() const { return std::filesystem::path(model).extension() == ".fmu"; }
bool PlantOptions::is_file() const { return is_fmu() || tuning::is_plant(io::load_json(model)); }

void say_on_fmu(const Session& session, const PlantOptions& plant, const tuning::Hardware& hardware,
                const ControllerDesign& design, Summary& summary) {
  deploy::FmuPlantOptions options = fmu_options(plant, hardware);
  options.delay_samples = static_cast<int>(std::lround(hardware.loop_delay() * hardware.timing.rate));
  const deploy::FmuLoop loop = deploy::run_fmu(design, plant.model, options);
  session.say(
      fmt::format("on the FMU, forces {} samples late: peak radius {:.4f} mm without control, {:.4f} mm with it",
                  options.delay_samples, 1e3 * loop.open_peak, 1e3 * loop.closed_peak));
  for (const std::string& warning : loop.summary.warnings) summary.fail("on the FMU: " + warning);
  if (!(loop.closed_peak < loop.open_peak)) summary.fail("on the FMU: the motion is larger than without control");
}

IdentifiedModel PlantOptions::load(tuning::DesignOptions& design, std::vector<std::filesystem::path>& inputs,
                                   identification::Consumer consumer) const {
  if (is_fmu()) return of_fmu(*this, design, inputs);
  if (!fmu_names.empty()) throw Error("--fmu-name: " + model + " is no FMU (NAME.fmu)");
  if (const io::Json document = io::load_json(model); tuning::is_plant(document)) {
    return of_plant(*this, document, design, inputs);
  }
  const IdentifiedModel identified = whirl::io::load<IdentifiedModel>(model);
  Summary refused;  // what is left out is said with the result
  take_parts(consumer, identified, refused, model);
  design.hardware = tuning::data_sheet(rig::read_rig(hardware));
  const std::vector<rig::RigMode> known = rig::read_modes(hardware);
  inputs.emplace_back(model);
  if (!stiffness.empty()) {
    if (!identified.rotor) throw Error(model + ": the model has no rotor parameters; identify with --method weak");
    design.gain = identified.rotor->k1 / whirl::io::load<StiffnessLaw>(stiffness).k1.value;
    inputs.emplace_back(stiffness);
  } else if (mass_kg > 0) {
    design.gain = 1 / mass_kg;
  } else if (!identified.rotor || identified.rotor->gain == 0) {
    throw Error("the rotor's mass is needed: give --mass-kg or --stiffness");
  }
  if (identified.rotor && design.gain > 0) {
    // m e omega^2 at the critical speed against what the actuators can do: no control law bridges a factor of
    // fifty.
    const double pull = std::abs(identified.rotor->eps) * identified.rotor->k1 / design.gain;
    const double limit = rig::read_rig(hardware).actuator.force_limit();
    if (limit > 0 && pull > 50 * limit) {
      throw Error(fmt::format(
          "{}: the unbalance then pulls with {:.3g} N at the critical speed, {:.0f} times the actuator's limit of "
          "{:.3g} N: is the mass in g, not kg?",
          mass_kg > 0 ? fmt::format("--mass-kg = {:g}", mass_kg)
                      : stiffness + " gives a mass of " + fmt::format("{:.3g} kg", 1 / design.gain),
          pull, pull / limit, limit));
    }
  }
  if (!modes.empty() && identified.rotor) {
    design.hardware.modes =
        tuning::structure_modes(whirl::io::load<ModalModel>(modes), identified.rotor->natural_frequency());
    inputs.emplace_back(modes);
  }
  design.hardware.modes = tuning::known_modes(design.hardware.modes, known);
  return identified;
}

}  // namespace whirl::app
