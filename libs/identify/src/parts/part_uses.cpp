#include "whirl/identify/parts/model_parts.hpp"

/// The declarations: one function a step, one case a part. A part without a case does not compile.
namespace whirl::identification {
namespace {

constexpr PartUse used() { return {}; }
constexpr PartUse noted(std::string_view why) { return {Treatment::noted, why}; }
constexpr PartUse warned(std::string_view why) { return {Treatment::warned, why}; }
constexpr PartUse refused(std::string_view why) { return {Treatment::refused, why}; }

constexpr std::string_view kFirstUnbalance = "the unbalance is that of the first record";
constexpr std::string_view kFirstMachine = "k1 and c are those of the first record";
constexpr std::string_view kNoRinging = "only the first seconds of the records had it";
constexpr std::string_view kTrueMotion = "the motion is that of the shaft, not what the probes read";
constexpr std::string_view kNoNoise = "the motion is without noise";
constexpr std::string_view kNoRotor =
    "it needs a rotor (k1, c, e): identify a record with beta and displacements by --method weak";
constexpr std::string_view kTheirPlace =
    "the motion is the displacement of the place where the sensors sat, as they are calibrated";
constexpr std::string_view kGivenSpeed = "the speed is given; its torque is not needed";

PartUse response_use(ModelPart part) {
  switch (part) {
    case ModelPart::cubic_spring:
    case ModelPart::unequal_axes:
    case ModelPart::coupled_damping:
    case ModelPart::further_modes:
    case ModelPart::tilting_disc:
    case ModelPart::further_forces:
    case ModelPart::twice_speed:
    case ModelPart::covered_readings:
    case ModelPart::other_readings:
    case ModelPart::covariance:
    case ModelPart::equations:
    case ModelPart::hidden_states:
      return used();
    case ModelPart::drifts:
      return warned(
          "a steady response has no time: k1, c and e are those at the reference of a drift, and after a change");
    case ModelPart::other_unbalances:
      return noted(kFirstUnbalance);
    case ModelPart::changed_machine:
      return warned(kFirstMachine);
    case ModelPart::ringing:
      return noted(kNoRinging);
    case ModelPart::runout:
    case ModelPart::sensor_delay:
    case ModelPart::sensor_errors:
      return noted(kTrueMotion);
    case ModelPart::noise:
      return noted(kNoNoise);
    case ModelPart::map:
      return refused("it needs equations in time: identify without --discrete, or run it by whirl simulate");
    case ModelPart::input_timing:
      return noted("the input acts as a cosine in time; amplitudes are the same, phases lag by the dead time more");
    case ModelPart::drive:
      return noted(kGivenSpeed);
    case ModelPart::other_quantity:
      return noted(kTheirPlace);
  }
  return {};
}

PartUse runup_use(ModelPart part) {
  switch (part) {
    case ModelPart::cubic_spring:
    case ModelPart::unequal_axes:
    case ModelPart::coupled_damping:
    case ModelPart::further_modes:
    case ModelPart::covered_readings:
    case ModelPart::other_readings:
    case ModelPart::covariance:
      return used();
    case ModelPart::tilting_disc:
      return refused("whirl simulate runs it through its speeds");
    case ModelPart::further_forces:
    case ModelPart::drifts:
    case ModelPart::twice_speed:
      return warned("the plan is without it; the rates suggested are run with it once");
    case ModelPart::other_unbalances:
      return noted(kFirstUnbalance);
    case ModelPart::changed_machine:
      return warned(kFirstMachine);
    case ModelPart::ringing:
      return noted(kNoRinging);
    case ModelPart::runout:
    case ModelPart::sensor_delay:
    case ModelPart::sensor_errors:
      return noted(kTrueMotion);
    case ModelPart::noise:
      return noted(kNoNoise);
    case ModelPart::equations:
    case ModelPart::map:
    case ModelPart::hidden_states:
    case ModelPart::input_timing:
      return refused(kNoRotor);
    case ModelPart::drive:
      return noted("the drive of the plan is that of --torque-nm and --inertia-kgm2");
    case ModelPart::other_quantity:
      return noted(kTheirPlace);
  }
  return {};
}

PartUse simulate_use(ModelPart part) {
  switch (part) {
    case ModelPart::cubic_spring:
    case ModelPart::unequal_axes:
    case ModelPart::coupled_damping:
    case ModelPart::further_modes:
    case ModelPart::tilting_disc:
    case ModelPart::further_forces:
    case ModelPart::drifts:
    case ModelPart::twice_speed:
    case ModelPart::covered_readings:
    case ModelPart::other_readings:
    case ModelPart::equations:
    case ModelPart::map:
    case ModelPart::hidden_states:
    case ModelPart::input_timing:
    case ModelPart::drive:
      return used();
    case ModelPart::other_unbalances:
      return noted(kFirstUnbalance);
    case ModelPart::changed_machine:
      return warned(kFirstMachine);
    case ModelPart::ringing:
      return noted(kNoRinging);
    case ModelPart::runout:
    case ModelPart::sensor_delay:
    case ModelPart::sensor_errors:
      return noted(kTrueMotion);
    case ModelPart::covariance:
      return noted("this is one run, of the most likely parameters");
    case ModelPart::noise:
      return noted(kNoNoise);
    case ModelPart::other_quantity:
      return noted(kTheirPlace);
  }
  return {};
}

PartUse validate_use(ModelPart part) {
  switch (part) {
    case ModelPart::cubic_spring:
    case ModelPart::unequal_axes:
    case ModelPart::coupled_damping:
    case ModelPart::further_modes:
    case ModelPart::tilting_disc:
    case ModelPart::further_forces:
    case ModelPart::drifts:
    case ModelPart::twice_speed:
    case ModelPart::runout:
    case ModelPart::sensor_delay:
    case ModelPart::sensor_errors:
    case ModelPart::covered_readings:
    case ModelPart::other_readings:
    case ModelPart::covariance:
    case ModelPart::noise:
    case ModelPart::equations:
    case ModelPart::map:
    case ModelPart::hidden_states:
    case ModelPart::input_timing:
    case ModelPart::drive:
    case ModelPart::other_quantity:
      return used();
    case ModelPart::other_unbalances:
      return noted("the unbalance is that of the first record, or what --unbalance says");
    case ModelPart::changed_machine:
      return warned(kFirstMachine);
    case ModelPart::ringing:
      return noted("this record's own start is fitted, without ringing of other modes");
  }
  return {};
}

PartUse balance_use(ModelPart part) {
  switch (part) {
    case ModelPart::covered_readings:
    case ModelPart::other_readings:
    case ModelPart::covariance:
      return used();
    case ModelPart::cubic_spring:
    case ModelPart::unequal_axes:
    case ModelPart::coupled_damping:
    case ModelPart::further_forces:
    case ModelPart::drifts:
    case ModelPart::sensor_delay:
    case ModelPart::sensor_errors:
    case ModelPart::noise:
    case ModelPart::ringing:
      return noted("the mass follows from the eccentricity alone, which was found beside it");
    case ModelPart::further_modes:
      return warned("the mass nulls the unbalance of the main mode; a further mode is excited by another share of it");
    case ModelPart::tilting_disc:
      return refused(
          "one plane does not take the tilt's unbalance away: balance it from runs (whirl balance runs.csv)");
    case ModelPart::twice_speed:
      return warned("no balance mass acts on it");
    case ModelPart::other_unbalances:
      return warned("the mass is for the unbalance of the first record");
    case ModelPart::changed_machine:
      return noted(kFirstMachine);
    case ModelPart::runout:
      return warned(
          "if the probe reads a bow of the shaft and not its runout, the mass that nulls the true motion differs: see "
          "docs/balancing.md");
    case ModelPart::equations:
    case ModelPart::map:
    case ModelPart::hidden_states:
    case ModelPart::input_timing:
      return refused(kNoRotor);
    case ModelPart::drive:
      return noted(kGivenSpeed);
    case ModelPart::other_quantity:
      return warned(
          "e is that of the place where the sensors sat: a housing moves by less than the rotor, and the mass is as "
          "much "
          "too small; trial runs (whirl balance runs.csv) need no such scale");
  }
  return {};
}

/// Of design and of all that runs a controller on plants made of the model.
PartUse plant_use(ModelPart part) {
  switch (part) {
    case ModelPart::cubic_spring:
    case ModelPart::unequal_axes:
    case ModelPart::further_forces:
    case ModelPart::drifts:
      return used();
    case ModelPart::coupled_damping:
      return warned("the plants damp each axis alone");
    case ModelPart::further_modes:
      return warned(
          "how the force and the sensor take part in it is not known: give its hammer test (--modes) or [modes.N] in "
          "the data sheet");
    case ModelPart::tilting_disc:
      return refused(
          "laws and margins are for a rotor whose disc does not tilt; balance it from runs (whirl balance runs.csv)");
    case ModelPart::twice_speed:
      return warned("the plants are without it: what it changes is not in these numbers");
    case ModelPart::other_unbalances:
      return noted(kFirstUnbalance);
    case ModelPart::changed_machine:
      return warned(kFirstMachine);
    case ModelPart::ringing:
      return noted("the runs begin with the structure ringing as the data sheet says");
    case ModelPart::runout:
      return noted("the plants have the runout of the data sheet");
    case ModelPart::sensor_delay:
      return warned("the plants have the latency of the data sheet (--hardware), not the one found");
    case ModelPart::sensor_errors:
      return warned("the plants' probes read both axes alike");
    case ModelPart::covered_readings:
      return noted("the numbers are those of the model's own reading; robustness draws over its intervals");
    case ModelPart::other_readings:
      return warned("the plants are of the model's own reading");
    case ModelPart::covariance:
      return noted("the plant is the most likely rotor; robustness draws over the covariance");
    case ModelPart::noise:
      return noted("the probes have the noise of the data sheet");
    case ModelPart::equations:
    case ModelPart::map:
    case ModelPart::hidden_states:
    case ModelPart::input_timing:
      return refused(kNoRotor);
    case ModelPart::drive:
      return noted(kGivenSpeed);
    case ModelPart::other_quantity:
      return warned(
          "a controller reads displacements: its probes must sit where the sensors of the records sat, and the zero of "
          "the motion is not known");
  }
  return {};
}

PartUse design_use(ModelPart part) {
  // The controller takes the runout found out of its readings; the certificate holds on every reading.
  if (part == ModelPart::runout || part == ModelPart::other_readings) return used();
  return plant_use(part);
}

PartUse margins_use(ModelPart part) { return part == ModelPart::other_readings ? used() : plant_use(part); }

PartUse robustness_use(ModelPart part) {
  if (part == ModelPart::covariance || part == ModelPart::covered_readings) return used();
  return plant_use(part);
}

PartUse export_use(ModelPart part) {
  switch (part) {
    case ModelPart::cubic_spring:
    case ModelPart::unequal_axes:
    case ModelPart::coupled_damping:
    case ModelPart::further_modes:
    case ModelPart::tilting_disc:
    case ModelPart::further_forces:
    case ModelPart::drifts:
    case ModelPart::twice_speed:
    case ModelPart::equations:
    case ModelPart::map:
    case ModelPart::hidden_states:
      return used();
    case ModelPart::other_unbalances:
      return noted(kFirstUnbalance);
    case ModelPart::changed_machine:
      return warned(kFirstMachine);
    case ModelPart::ringing:
      return noted(kNoRinging);
    case ModelPart::runout:
    case ModelPart::sensor_delay:
    case ModelPart::sensor_errors:
      return warned("x_sensor and y_sensor are the motion of the shaft, without it");
    case ModelPart::covered_readings:
    case ModelPart::other_readings:
      return warned("the export is the model's own reading");
    case ModelPart::covariance:
      return noted("the export is the most likely model; its parameters may be changed");
    case ModelPart::noise:
      return noted("its outputs are without noise");
    case ModelPart::input_timing:
      return warned("inputs act at once and as they are: hold them and delay them outside");
    case ModelPart::drive:
      return warned("beta, omega and alpha are inputs: the equation of the speed is not exported");
    case ModelPart::other_quantity:
      return noted(kTheirPlace);
  }
  return {};
}

PartUse report_use(ModelPart) { return used(); }  // it prints the model

}  // namespace

PartUse use_of(Consumer consumer, ModelPart part) {
  switch (consumer) {
    case Consumer::response:
      return response_use(part);
    case Consumer::runup:
      return runup_use(part);
    case Consumer::simulate:
      return simulate_use(part);
    case Consumer::validate:
      return validate_use(part);
    case Consumer::balance:
      return balance_use(part);
    case Consumer::design:
    case Consumer::compare:
      return design_use(part);
    case Consumer::margins:
      return margins_use(part);
    case Consumer::robustness:
      return robustness_use(part);
    case Consumer::export_model:
      return export_use(part);
    case Consumer::report:
      return report_use(part);
  }
  return {};
}

}  // namespace whirl::identification
