#pragma once
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/identified_model.hpp"

namespace whirl::identification {

struct RotorTerm;

/// What `identify` may put into a model beside its plain numbers. Each step that takes a model declares for every part
/// what it does with it (use_of); a part that is not declared does not compile.
enum class ModelPart {
  cubic_spring,      ///< rotor.k2
  unequal_axes,      ///< rotor.k1_conj, the real part of rotor.c_conj
  coupled_damping,   ///< the imaginary part of rotor.c_conj: damping that couples the axes
  further_modes,     ///< rotor.modes
  tilting_disc,      ///< four degrees of freedom (has_tilt)
  further_forces,    ///< terms that are forces, but for the next two
  drifts,            ///< stiffness or damping that drifts in time
  twice_speed,       ///< force at twice the speed
  other_unbalances,  ///< e_2, e_phase_2, ... of further records
  changed_machine,   ///< k1_change_2, c_change_2, ...: k1 and c of further records
  ringing,           ///< modes that ring at the start of the records (decay1_omega, ...)
  runout,            ///< of the probe's tracks
  sensor_delay,      ///< the probes read late
  sensor_errors,     ///< gain, angle, skew, AC coupling, curve of the probes
  covered_readings,  ///< ambiguities that intervals and rotor_covariance cover
  other_readings,    ///< ambiguities with another kind of force, which they do not cover
  covariance,        ///< intervals and covariances
  noise,             ///< noise_sd, noise_correlation
  equations,         ///< equations of another system than a rotor
  map,               ///< equations from one sample to the next
  hidden_states,     ///< states h1, h2, ... that no channel measures
  input_timing,      ///< inputs that are held or late
  drive,             ///< equation of the speed
  other_quantity,    ///< its records read velocity or acceleration
};
inline constexpr std::size_t kModelParts = static_cast<std::size_t>(ModelPart::other_quantity) + 1;

/// Steps that take a model. `whirl run` takes the controller: what holds for `design` holds there.
enum class Consumer {
  response,
  runup,
  simulate,
  validate,
  balance,
  design,
  margins,
  robustness,
  compare,
  export_model,
  report,
};
inline constexpr std::size_t kConsumers = static_cast<std::size_t>(Consumer::report) + 1;

/// What a step does with a part.
enum class Treatment {
  used,     ///< its numbers follow from it
  noted,    ///< left out, and the result holds as it is: a Finding with Consequence::note
  warned,   ///< left out, and the result may be off: a Finding with Consequence::warning
  refused,  ///< an error that names the part and what to do
};
struct PartUse {
  Treatment treatment = Treatment::used;
  std::string_view why = {};  ///< noted, warned: what it may change; refused: what to do
};

std::string_view to_string(ModelPart part);       ///< in words, e.g. "cubic spring"
std::string_view to_string(Consumer consumer);    ///< e.g. "simulate"
std::string_view to_string(Treatment treatment);  ///< "used", "noted", "warned", "refused"

PartUse use_of(Consumer consumer, ModelPart part);

/// A part that a model has, with its sizes.
struct PresentPart {
  ModelPart part = ModelPart::cubic_spring;
  std::vector<Amount> amounts = {};
};
std::vector<PresentPart> parts_of(const IdentifiedModel& model);
/// The part that a force beyond RotorModel belongs to.
ModelPart part_of(const RotorTerm& term);

/// What `consumer` does with the parts of the model: throws Error for the first that it refuses ("FILE: ..."), adds a
/// Finding (part_left_out) for each that it leaves out.
void take_parts(Consumer consumer, const IdentifiedModel& model, Summary& summary, std::string_view file = "model");

/// The table consumer x part as Markdown: what docs/parts.md holds between its markers.
std::string parts_table();

}  // namespace whirl::identification
