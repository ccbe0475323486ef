#pragma once
#include <complex>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "whirl/control/laws/state_space.hpp"
#include "whirl/control/runout.hpp"
#include "whirl/core/control_types.hpp"
#include "whirl/core/identified_model.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/rotor/further_forces.hpp"
#include "whirl/tuning/closed_loop.hpp"

namespace whirl::tuning {

/// What a designer knows about the machine without looking into it: data sheets, wiring and the speed
/// profile. The fields that no data sheet states (gain error, axis rotation, initial deflections) stay at
/// their neutral values.
struct Hardware {
  rig::RigLaser laser;        ///< noise, range, bits, rate, latency; runout_*: amplitudes to expect, phases are unknown
  rig::RigActuator actuator;  ///< gain_error and axis_rotation are not known: 0
  rig::RigEncoder encoder;
  rig::RigTiming timing;
  rotor::SpeedProfile profile = rig::RigParameters::default_profile();
  /// Structural modes as the loop sees them: participation the share of the actuator's force, sensor_sign the sign of
  /// the shape at the sensor times that at the actuator; 0: not known, then tuning, margins and certificate take both.
  /// From a hammer test (structure_modes) or the data sheet (known_modes); none when not tested.
  std::vector<rig::RigMode> modes;
  /// Amplitude of the first harmonic by which an identified runout may be wrong, 95 %, m (with_forces).
  double runout_error = 0;
  std::optional<control::Runout> slow_roll;  ///< to remove; without it the runout identified with the rotor, if any
  /// Forces of the rotor beyond RotorModel, per unit mass: what `whirl identify` found (with_forces).
  rotor::FurtherForces<double> forces;

  /// The same hardware for every choice of the signs that are not known (all of up to three, else all + and all -);
  /// itself alone when all are known.
  std::vector<Hardware> sign_cases() const;
  /// "mode 1 (46.0 Hz) -" for the modes whose sign is not known here and chosen in `chosen`; empty when none is.
  std::string signs_of(const Hardware& chosen) const;
  double loop_delay() const;  ///< sensor latency + computation + first-order lag 1/(2 pi f), without the hold, s
};

/// The data-sheet part of a rig: laser noise, range, resolution, rate and latency, actuator range,
/// resolution, bandwidth and computation delay, encoder, control rate, speed profile without ripple. Runout
/// is set to 10, 5, 2.5 um with zero phases, a common surface; everything else that only the rig knows is
/// left out.
Hardware data_sheet(const rig::RigParameters& rig);

/// Modes of the structure beside the rotor's own from a hammer test with the hammer at the actuator and the pick-up at
/// the sensor: frequency and damping as identified, the signed participation from the residues: the inverse modal mass
/// -2 Im(p) Im(a) of a mode relative to that of the rotor's own mode, taken from the channel in which the rotor answers
/// most. The sign is not known (0) when response and reference are the same point (a drive point: the residue is the
/// square of the shape, whatever the loop sees) unless it is negative; sign and size (then `fallback`) are not known
/// when no mode lies within 10 % of `rotor_omega`, rad/s. Modes below 0.05 % of the rotor's are left out.
std::vector<rig::RigMode> structure_modes(const ModalModel& modal, double rotor_omega, double fallback = 0.02);

/// `modes` with those of the data sheet: one within 5 % in frequency is replaced, the others are added.
std::vector<rig::RigMode> known_modes(std::vector<rig::RigMode> modes, const std::vector<rig::RigMode>& data_sheet);

/// The hardware with the model's further forces (RotorTerm), as many Runge-Kutta steps as its friction needs, and the
/// error of the runout that was identified with it.
Hardware with_forces(Hardware hardware, const IdentifiedModel& model);

/// The further forces of the model that the plants of with_forces lack: friction that is too sudden for 256 steps per
/// tick, or negative. "Coulomb friction"; empty: none.
std::vector<identification::RotorTerm> forces_left_out(const IdentifiedModel& model, const Hardware& hardware);

/// The plant a design is tuned on: the identified rotor with the hardware's data sheets and further forces.
rig::RigParameters tuning_plant(const RotorModel& model, const Hardware& hardware);

struct DesignProgress {
  long evaluation = 0, budget = 0;
  double objective = 0, best = 0;
};

/// A linear law that the user wrote (read_law): displacement in m and velocity in m/s to force in N.
struct OwnLaw {
  control::LinearAxis x, y;
  double sample_time = 0;  ///< s
};

/// Told how far a design is. May be empty.
struct DesignWatch {
  std::function<void(const DesignProgress&)> tuning;
  std::function<void(double)> training;  ///< of laws with weights: fraction that is done
};

/// What some laws take beside their parameters.
struct LawInputs {
  std::optional<OwnLaw> own;  ///< of law `state_space`: only the estimator is tuned then
  /// Laws with weights: closed-loop runs on random machines that their training may take, before the search; 0: 48 for
  /// each evaluation.
  long training_runs = 0;
};

struct DesignOptions {
  std::string law = "tsmc";       ///< whirl::laws()
  std::string estimator = "kfe";  ///< whirl::estimators()
  bool feedforward = true;
  Hardware hardware;
  double gain = 0;  ///< acceleration per newton, 1/kg; 0: the model's
  LawInputs inputs;
  std::map<std::string, double> fixed;  ///< parameters given by hand: not tuned
  int evaluations = 160;                ///< of the objective, the same for every law: two thirds CRS2, the rest SBPLX
  std::uint64_t seed = 1;               ///< of the search and of the sensor noise while tuning
  int threads = 0;                      ///< scenarios in parallel; 0 = all cores. The result does not depend on it
  double stiffness_uncertainty = 0.3;   ///< relative; the design is certified only when stable at -this
  DesignWatch progress;
};

/// Tunes the numbers of a law and its estimator on a plant built from the identified model and the data
/// sheets alone.
///
/// Refused (Summary unusable, nothing tuned) when the model does not explain its own record.
///
/// Objective, mean over the scenarios: 0.5 mean over segments 1-4 of (closed peak / open peak) + 0.5 of the whole run
/// + 0.02 TV / (1000 N/s) + a graded penalty when unstable. Scenarios, each with another error of the unbalance, the
/// structural modes ringing when the run begins: nominal; one sample of delay the controller does not know; stiffness
/// -13 % (model 15 % too stiff); stiffness -30 %; balanced rotor with actuators 25 % stronger; structural modes 1.5
/// times as strong (when known). To it is added 0.1 log(peak sensitivity / 3) where that is above 3 at one of three
/// speeds. Search in log space over (C, rho/eps, rho, r, delta, cutoff, ...). The result is the
/// best of what the search tried that is certified, among at most six that differ and cost at most half as much again;
/// when none is, the best, not certified.
///
/// `margins` of the result: objective; of loop_margins at twelve speeds, the worst and verified in the running loop:
/// delay_margin_s and gain_margin (at most 12 samples and 8: more is not tried), gain_margin_down, phase_margin_deg,
/// modulus_margin, peak_sensitivity;
/// static_stiffness (closed-loop stiffness at K1 -30 %, relative to k1), open_peak_m and trip_displacement_m (open-loop
/// peak of the tuning plant, and the displacement at which a run is lost: half of it, at least four times the closed
/// one, at most 90 % of it), excess_variation (N/s, nominal: what the judge of later runs refers to),
/// disturbance_bound, kappa (eq. 42: rho - |Delta| > 0), reach_time_s, slide_time_s, nominal_peak_m (tuning plant),
/// typical_peak_m (median of 64 machines that `robustness` draws of this model) and peak_m: the largest of 64 through
/// each of the profile, its reverse and the critical speed held, so that with 96 % confidence at most 5 % of such
/// machines exceed it (Wilks, Ann. Math. Stat. 12, 1941), and at least the largest on any plant of the certificate:
/// actuators 5 % stronger or weaker and 2.6 degrees off, the profile reversed, the critical speed held and swinging,
/// structural modes as below, all with and without a structure that rings; certified (1 or 0). Not certified when the
/// nominal run or one of those, or one with another sign or 1.5 times the participation of the structural modes, or
/// these 0.2 % off in frequency, fails the judge (verdict.hpp); nor when those actuators make the peak more than twice
/// the nominal one and 30 um, or its own supervision steps in; nor when the drawn machines show that more than 5 % of
/// them fail the judge; nor when margins do not reach those of a peak sensitivity of 4 (VerdictLimits) or half a sample
/// of delay; nor when the closed loop at K1 -30 % has negative static stiffness or is unstable: then the summary is
/// unusable and says why. Structural modes whose sign is known go into the controller (mode_1_omega, ...), which takes
/// their answer to the force out of the readings.
///
/// A law with weights (`learned`) is trained before the search, on random machines in lanes (training.hpp): margins
/// training_runs, training_start and training_cost, the mean objective on 32 machines not trained on, before and after.
///
/// Throws Error when the model is no rotor, has no input gain, or a name or fixed parameter is wrong.
ControllerDesign design(const IdentifiedModel& model, const DesignOptions& options);

/// Says what of the model `consumer` leaves out (identification::take_parts, which may throw; further modes that the
/// hardware knows are in the plants), which forces the plants cannot have (forces_left_out), and from which speed on
/// the rotor whirls by itself inside the speed range when nothing holds it.
void state_parts(identification::Consumer consumer, const IdentifiedModel& model, const Hardware& hardware,
                 Summary& summary);

/// Sensor runout as far as the identification found it (parameters runout1+_re, ... of the model: amplitudes
/// of e^{i k beta} and e^{-i k beta}); empty when it did not.
control::Runout identified_runout(const IdentifiedModel& model);

/// The design before tuning: names, model, hardware and fixed parameters with the catalogue's defaults.
ControllerDesign untuned_design(const IdentifiedModel& model, const DesignOptions& options);

/// Recomputes `margins` and `summary` for a design whose parameters were set by hand, on the plant of
/// `options.hardware` (with_forces).
void assess(ControllerDesign& design, const DesignOptions& options);

}  // namespace whirl::tuning
