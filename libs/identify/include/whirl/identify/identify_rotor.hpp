#pragma once
#include <optional>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/evidence.hpp"
#include "whirl/identify/output_error_rotor.hpp"
#include "whirl/identify/rotor_record.hpp"

namespace whirl::identification {

/// Where the rotor angle comes from.
enum class AngleSource {
  measured,  ///< encoder or pulses: taken as it is
  profile,   ///< assumed speed profile: its rate is searched and refined together with the rotor
  /// none: the vibration's own phase, a polynomial in time refined together with the rotor (profile_degree of it). The
  /// phase of e means nothing then
  vibration,
};

struct RotorIdentifyOptions {
  RotorRecordOptions record;
  AngleSource angle_source = AngleSource::measured;
  double profile_search = 0.01;  ///< largest relative error of the assumed rate beta'', AngleSource::profile only
  int profile_degree = 2;        ///< polynomial degree of the angle correction, AngleSource::profile only, 2 to 6
  double half_width = 0;         ///< of the weak test functions, s; 0: automatic
  double score_threshold = 16;   ///< a term is added when its score reaches this (4 sigma)
  /// Hammer test: its modes beyond the main one are candidates, in output form, forced by the unbalance ("mode k") and
  /// decaying from the start of the record ("decay k").
  std::optional<ModalModel> modal;
  /// Without a hammer test, or beyond it: when chi_square > 1.3, forced modes are searched from a quarter of the top
  /// speed to 1.4 times it. As they are found by search they need three times the score threshold.
  bool search_modes = true;
  bool refine_poles = true;  ///< w and zeta of added modes and decays are refined
  bool delay = true;         ///< candidate: displacement channels that lag the angle
  bool terms = true;         ///< candidates: the forces of RotorTerm and the axes of the y probe
  int runout_harmonics = 3;  ///< candidates: shaft runout at orders 1 .. n read by the probes, 0 to 4
};

/// Everything the default pipeline found, for reports and for `validate`.
struct RotorIdentification {
  IdentifiedModel model;
  OutputErrorFit fit;                    ///< of the last refinement; records in the order given
  OutputErrorOptions active;             ///< terms that were estimated
  std::vector<std::string> added;        ///< terms added by the score test, in order, e.g. "mode 21.2 Hz"
  bool mode_found = false;               ///< one of them is a mode within the speeds
  double chi_square_weak = 0;            ///< of the final model
  std::vector<std::string> assumptions;  ///< what the model takes for granted where a channel is missing
};

/// Rotor model from run-up or run-down records: the default pipeline.
///
/// 1. weak form, order-tracked, generalised least squares (fit_weak_rotor): no starting guess;
/// 2. AngleSource::profile: search of the rate within +- profile_search by the weak residual;
/// 3. output-error refinement with sensor offset, initial state and, for a profile, the angle correction;
/// 4. score test (score_rotor_terms): the most significant term among conj z, conj z', modes, decays, runout, sensor
///    delay, sensor axes and the forces of RotorTerm is added while it reaches the threshold and the trajectory
///    confirms it, each time refining and simulating again; significant terms that the model cannot hold are named in
///    the warnings. Where several candidates are significant the trajectory decides between them; a term that later
///    ones make needless is taken out again. The threshold grows with the number of candidates;
/// 5. covariance scaled by max(1, chi_square): the weak residual is both the alarm and the scale.
///
/// Several records share the rotor; each has its own unbalance (parameters e, e_phase, then e_2, e_phase_2, ...).
/// `equations` is in paper states X1 = x - offset_x, X2 = x', X3 = y - offset_y, X4 = y' with inputs X5 = beta, X6 =
/// beta', X7 = beta''; terms with a common unknown are written as one function. parameters: k1, k2, c, e, e_phase,
/// natural_frequency (rad/s), damping_ratio, offset_x, offset_y, and where added k1_conj_re, k1_conj_im, c_conj_re,
/// c_conj_im (natural_frequency and damping_ratio: of the forward whirl as the records passed it; k1, k2 and c of the
/// equations: their intervals cover the terms that the records do not exclude), the parameters of term_catalogue(),
/// sensor_gain, sensor_angle (rad), sensor_skew (s), sensor_high_pass (rad/s), sensor_high_pass_square
/// (rad^2/s^2), sensor_cubic (1/m^2), sensor_gain_drift (1/s, from sensor_drift_start on), delay (s),
/// runout1+_re, ..., mode1_omega, mode1_zeta, mode1_re,
/// ..., decay1_omega, decay1_zeta, ...
///
/// Summary: `residual` is the rms of measured minus simulated, m (both axes); status unusable with a reason when the
/// records cannot give a rotor or the model explains them badly, warning with model error or weakly determined
/// parameters. Throws Error for missing channels or options out of range.
RotorIdentification identify_rotor_detailed(const std::vector<RotorRecord>& records,
                                            const RotorIdentifyOptions& options = {});
/// The same from recordings; AngleSource::vibration takes the angle from the motion first.
RotorIdentification identify_rotor_detailed(const std::vector<Recording>& recordings,
                                            const RotorIdentifyOptions& options = {});
IdentifiedModel identify_rotor(const Recording& recording, const RotorIdentifyOptions& options = {});
IdentifiedModel identify_rotor(const std::vector<Recording>& recordings, const RotorIdentifyOptions& options = {});

}  // namespace whirl::identification
