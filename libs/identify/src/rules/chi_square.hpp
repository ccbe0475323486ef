#pragma once

/// One scale of chi-square for models of every kind: what is left of the readings, or of the whitened weak equations,
/// by the noise, both squared and per degree of freedom. 1 where the model fits.
///
/// Of n readings it deviates by sqrt(2/n), 0.05 with 1000, and the noise is known to about a tenth in variance
/// (`record_noise.cpp`): 1.3 is 2.7 deviations of both together, and 4 of 1000 models that are right lie above it.
namespace whirl::identification::rules {

inline constexpr double kModelError = 1.3;    ///< above: something is missing, intervals are widened
inline constexpr double kNoTrust = 2;         ///< above: what is missing is as large as the noise
inline constexpr double kAnotherModel = 4;    ///< above: so large that every absent term shows a sign of it
inline constexpr double kAngleUnknown = 1.5;  ///< above, with an angle read from the vibration: it is not that angle

}  // namespace whirl::identification::rules
