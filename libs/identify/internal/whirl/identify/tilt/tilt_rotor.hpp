#pragma once
#include <limits>
#include <optional>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/rotor_model.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/identify/validate.hpp"

namespace whirl::identification {

/// A rotor whose disc tilts with the shaft (four degrees of freedom), per unit mass, z = x + i y the disc's centre, q
/// its tilt times a length that makes the coupling symmetric; q has no probe:
///
///   z'' = -k1 z - k2 |z|^2 z - c z' - k_couple q + eps F
///   q'' = -k_tilt q - k_couple z - c_tilt q' + i polar_ratio omega q' + eps_tilt F
///
/// F as in RotorModel; polar_ratio: polar by diametral moment of inertia. k1 and k_tilt hold with the other coordinate
/// held; a support that moves reads alike with polar_ratio 0. Source: Genta, Dynamics of Rotating Systems, 2005,
/// chapter 6 (linear 4-degree-of-freedom rotor).
///
/// States of the model: X1 = x - offset_x, X2 = x', X3 = y - offset_y, X4 = y', tilt_x, tilt_vx = tilt_x', tilt_y,
/// tilt_vy; it has no `rotor`, so that nothing that needs one takes it. Parameters: k1, k2, c, e, e_phase, k_tilt,
/// k_couple, c_tilt, polar_ratio, e_tilt, e_tilt_phase, offset_x, offset_y, and of the lower and the upper mode at
/// standstill natural_frequency and second_frequency (rad/s).
bool has_tilt(const IdentifiedModel& model);

/// Such a rotor by free runs of one record, from several starts about the plain rotor that explains it best; the hidden
/// motion is estimated. Nothing where its noise is coloured, it has hum or drift, or no start follows it; `target`:
/// residual by noise that the fit has to come below, a start that will not is given up. `chi_square` of the summary:
/// residual variance by the noise, over all frequencies or at those of the motion, the larger.
std::optional<IdentifiedModel> fit_tilt_rotor(const RotorRecord& record, const RotorModel& start,
                                              double target = std::numeric_limits<double>::infinity());
/// The same begun at a model of that kind, of a record of the same machine.
std::optional<IdentifiedModel> fit_tilt_rotor(const RotorRecord& record, const IdentifiedModel& like);

/// Channels x, y (as the probes read them) and beta along an angle, from the steady whirl of the linear model at its
/// first speed. Throws Error where the motion diverges.
Recording simulate_tilt_rotor(const IdentifiedModel& model, const AngleSignal& angle, double t0 = 0);

/// As `validate`, the start fitted to the run. Throws Error for another unbalance than the identified one.
Validation validate_tilt_rotor(const IdentifiedModel& model, const Recording& recording,
                               const ValidateOptions& options = {});

}  // namespace whirl::identification
