#pragma once
#include <string_view>

namespace whirl {

/// Physical kind of a signal. Values are always stored in the SI unit given by `si_unit`.
enum class Quantity {
  time,
  displacement,
  velocity,
  acceleration,
  force,
  angle,
  angular_velocity,
  angular_acceleration,
  frequency,
  voltage,
  current,
  pressure,
  mass,
  temperature,
  strain,
  dimensionless,
};

/// SI unit symbol, e.g. "m/s^2"; "1" for dimensionless. Angular velocity is rad/s, frequency Hz.
std::string_view si_unit(Quantity quantity);
/// Name in words, e.g. "displacement".
std::string_view to_string(Quantity quantity);

/// How an amplitude is stated. Every printed amplitude says which.
enum class AmplitudeKind { peak, peak_to_peak, rms };
std::string_view to_string(AmplitudeKind kind);

}  // namespace whirl
