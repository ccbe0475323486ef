#pragma once
#include <complex>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/core/finding.hpp"
#include "whirl/tuning/design.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::tuning {

/// ISO 14839-3 zones of the peak sensitivity: A below 3 (9.5 dB), B below 4 (12 dB), C below 5 (14 dB), D above.
char sensitivity_zone(double peak_sensitivity);

/// The loop opened at the force, both axes as one complex loop z = x + i y: a frequency above zero whirls with the
/// rotor, below zero against it.
struct LoopResponse {
  std::vector<double> frequency;           ///< Hz, ascending, negative ones included
  std::vector<std::complex<double>> loop;  ///< L: force the controller answers with / force acting, sign of 1 + L
  std::vector<double> deviation;           ///< standard deviation of each part of L; empty: not known
};

/// Distance of one loop response from -1.
struct LoopMargins {
  double omega = 0;                   ///< speed of the shaft, rad/s
  bool stable = true;                 ///< the motion at this speed does not grow
  double gain_up = 0, gain_down = 0;  ///< factors on the loop gain that reach the limit; infinite, 0: none does
  double gain_frequency = 0;          ///< Hz of the nearer one
  double phase = 0;                   ///< rad, smallest turn of L either way
  double phase_frequency = 0;         ///< Hz
  double delay = 0;                   ///< s of further delay; infinite: none
  double delay_frequency = 0;         ///< Hz
  double modulus = 1;                 ///< smallest |1 + L|
  double peak_sensitivity = 1;        ///< largest |S| = 1 / modulus
  double peak_deviation = 0;          ///< standard deviation of peak_sensitivity; 0: exact or not known
  double phase_deviation = 0;         ///< of phase, rad
  double peak_complementary = 0;      ///< largest |T| = |L S|
  double peak_frequency = 0;          ///< Hz of max |S|
  bool simulated = false;             ///< gain_up or delay is that of the running loop, not of the linearised one
  char zone() const { return sensitivity_zone(peak_sensitivity); }
};

/// Margins of a response of a loop that is stable as it is: the first gain, phase and delay at which 1 + L = 0
/// somewhere. Between lines that lie apart by more than their noise, L is the arc of a resonance through three of them.
/// The margins hold together (hold_together).
LoopMargins margins_of(const LoopResponse& response);

/// A loop cannot be farther from -1 than the gain or the phase that brings it there: modulus <= |1 - 1/gain_up|,
/// <= 1/gain_down - 1, <= 2 sin(phase / 2). Lowers the modulus to the least of them, with peak_sensitivity = 1 /
/// modulus: a gain found in the running loop may be nearer than the loop of small motion.
void hold_together(LoopMargins& margins);

struct MarginOptions {
  int speeds = 12;    ///< from standstill to the top of the profile, both included
  double settle = 3;  ///< s before the response counts
  double window = 4;  ///< s of one period of the excitation: resolution 1 / window
  /// Most excitations with other phases, averaged: two, four, ... until the peak sensitivity is certain to 5 % (two
  /// standard deviations). 1: one, its noise not known.
  int repeats = 32;
  /// Force of the excitation, N rms of an axis; 0: what deflects the shaft by 1 um.
  double force = 0;
  std::uint64_t seed = 1;
  int threads = 0;     ///< 0 = all cores; the result does not depend on it
  bool verify = true;  ///< try gain and delay in the running loop
};

struct SpeedMargins {
  LoopMargins margins;
  LoopResponse response;
};

/// True for laws and estimators whose gain follows the motion: sliding terms, adaptive and barrier gains,
/// differentiators with a power of the error, corrections once per turn. Their sensitivity is that of small motion.
bool gain_follows_motion(const ControllerDesign& design);

/// Loop gain, sensitivity and margins of `design` on `rig` at constant speeds.
///
/// The controller is the real step function and its operating point the synchronous orbit at that speed, with the noise
/// of the sensors: the same run is made with and without a small force of all frequencies (multisine, random phases),
/// and the difference of the two is the small-signal response about that orbit: of a linear law exact, of a sliding
/// term its gain averaged over the orbit and the noise, known to the scatter of the excitations
/// (response_estimate.hpp). S = 1 + u_c / d and L = 1/S - 1, u_c the controller's part and d the excitation.
///
/// The gain and delay margins are then tried in the running loop, without excitation: inside them no motion may stand
/// (by the judge's limits). Of laws whose gain follows the motion - sliding terms, `asmc`, `bsmc`, `pd_influence`,
/// estimators `red` and `kalman` - both are found by turning gain and delay up in the running loop, gain to 8 in steps
/// of 2 % (5 % above 1.3) and delay to 12 samples, and `simulated` says so: the first at which motion stands, limit
/// cycles that end again at a higher gain included. Phase and modulus remain those of the small motion.
///
/// Converters are taken without resolution and forces without limit. Motion that couples forward with backward whirl
/// (anisotropy, axes with different gains) is left out of L; it is in the run that decides `stable`.
/// Throws Error for a bad design or rig.
std::vector<SpeedMargins> loop_margins(const ControllerDesign& design, const rig::RigParameters& rig,
                                       const MarginOptions& options = {});

/// The worst over the speeds: smallest gain, phase, delay and modulus margin, largest peaks.
LoopMargins worst_margins(const std::vector<SpeedMargins>& speeds);

/// The first requirement that margins miss: a stable loop; gain, phase and modulus that a peak sensitivity of
/// VerdictLimits allows; delay. Code requirement_missed, amounts `value` and `least` or `most`; nothing: all are met.
std::optional<Finding> missed_margin(const LoopMargins& margins, double sample_time, const VerdictLimits& limits = {});
/// The same of the worst over the speeds, with the speed in words: the one rule of `design` and `margins`.
std::optional<Finding> margin_failure(const std::vector<SpeedMargins>& speeds, const ControllerDesign& design);

/// Margins on one plant that the machine may be.
struct MarginStudy {
  /// The reading of the model's records and the signs chosen where they are not known; empty: the model itself, all
  /// known.
  std::string plant;
  std::vector<SpeedMargins> speeds;
};

/// Margins on the plant of the model and the data sheets, for every choice of the signs of structural modes that are
/// not known, and on those of the readings of its records that no interval of it covers. Throws Error when the model
/// has no rotor or no input gain.
std::vector<MarginStudy> margin_studies(const ControllerDesign& design, const IdentifiedModel& model,
                                        const DesignOptions& plant, const MarginOptions& options = {});

}  // namespace whirl::tuning
