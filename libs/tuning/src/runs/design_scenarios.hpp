#pragma once
#include <string>
#include <vector>

#include "whirl/identify/rotor_terms.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

/// How the speed runs. A speed is held at the natural frequency, where the profile passes it.
enum class Course {
  profile,   ///< as the hardware says
  reversed,  ///< the profile the other way round: run-up instead of run-down
  dwell,     ///< held at the critical speed
  swinging,  ///< held there by a drive that lags: the speed swings about it
};

/// "the critical speed held".
std::string course_name(Course course);

/// `profile` run so; `natural` in rad/s.
rotor::SpeedProfile profile_of(Course course, rotor::SpeedProfile profile, double natural);

/// Whether the profile passes the natural frequency.
bool passes_critical(const RotorModel& model, const Hardware& hardware);

/// One plant on which a candidate is judged, made from the model with stated errors.
struct TuningScenario {
  std::string name;
  double stiffness = 1, cubic = 1, damping = 1;  ///< true / model
  std::complex<double> unbalance = 1;            ///< true / what the controller is told
  double told_unbalance = 1;                     ///< what the controller is told / model: a re-balanced rotor
  int extra_delay = 0;                           ///< samples the controller does not know
  double modes = 1;                              ///< strength of the structural modes
  bool other_signs = false;                      ///< of the modes whose sign is not known: all - instead of all +
  double gain = 1;                               ///< of the actuators: true / model
  double mode_frequency = 1;                     ///< of the structural modes: true / known
  double axis = 0;                               ///< of the actuators against the sensors, rad
  Course course = Course::profile;
  double ringing = 0;  ///< of the structure at the beginning: velocity of each of its modes /
                       ///< that of the centre of mass at top speed
};

/// The scenarios of the tuning (see `design`). The errors are typical of an identification at the sensors'
/// noise: a few per cent and degrees of unbalance, a damping that is hard to see.
std::vector<TuningScenario> tuning_scenarios(const Hardware& hardware, double stiffness_uncertainty);

/// The plant of a scenario.
ClosedLoopPlant scenario_plant(const TuningScenario& scenario, const RotorModel& model, const Hardware& hardware,
                               std::uint64_t seed);

/// The hardware as the tuning plant has it: of each harmonic that the design removes by a runout table a tenth is left,
/// at least Hardware::runout_error of the first.
Hardware tuning_hardware(const ControllerDesign& design, const Hardware& hardware);

/// The design as it would run on that plant: told unbalance scaled; no offset and no runout table, because
/// the plant's sensors have another runout than the machine's.
ControllerDesign on_scenario(ControllerDesign design, const TuningScenario& scenario);

/// The terms as the rig has them, per unit mass.
rotor::FurtherForces<double> further_forces(const std::vector<identification::RotorTerm>& terms);

/// Restoring acceleration per metre that the controller adds against a displacement held still, 1/s^2.
double static_control_stiffness(const ControllerDesign& design);

/// Cost of one run, see `design`.
double tuning_cost(const ClosedLoopMetrics& metrics);

}  // namespace whirl::tuning
