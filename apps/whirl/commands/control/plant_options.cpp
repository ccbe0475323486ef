#include "plant_options.hpp"

#include "whirl/core/error.hpp"
#include "whirl/identify/tilt/tilt_rotor.hpp"
#include "whirl/io/json.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/tuning/plant_file.hpp"

namespace whirl::app {

void PlantOptions::add_to(CommandLine* sub) {
  sub->add_option("--mass-kg", mass_kg, "mass of the disk")->positive();
  sub->add_option("--stiffness", stiffness, "stiffness.json of the pull test: gives the mass")
      ->input()
      ->excludes("--mass-kg");
  sub->add_option("--modes", modes, "modes.json of the hammer test: the tuning plant gets these modes")->input();
  sub->add_option("--hardware", hardware,
                  "TOML with the data sheets; default: those of the virtual rig. [modes.N] frequency_hz, "
                  "damping_percent, participation and sensor_sign (0: not known): structural modes that are known")
      ->input();
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

}  // namespace

bool PlantOptions::is_file() const { return tuning::is_plant(io::load_json(model)); }

IdentifiedModel PlantOptions::load(tuning::DesignOptions& design, std::vector<std::filesystem::path>& inputs) const {
  if (const io::Json document = io::load_json(model); tuning::is_plant(document)) {
    return of_plant(*this, document, design, inputs);
  }
  const IdentifiedModel identified = whirl::io::load<IdentifiedModel>(model);
  if (identification::has_tilt(identified))
    throw Error(model +
                ": the disc of this model tilts: laws, balancing and margins are for a rotor whose disc does not; "
                "balance it from runs (whirl balance runs.csv)");
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
