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
  torque,
  stiffness,          ///< linear, N/m
  cubic_stiffness,    ///< N/m^3
  damping,            ///< viscous, N s/m
  moment_of_inertia,  ///< kg m^2
  rate,               ///< 1/s
  rate_squared,       ///< 1/s^2, e.g. stiffness per mass
  force_constant,     ///< actuator force per volt, N/V
  specific_energy,    ///< m^2/s^2, e.g. half the square of a sliding variable
  specific_power,     ///< m^2/s^3
};

/// SI unit symbol, e.g. "m/s^2"; "1" for dimensionless. Angular velocity is rad/s, frequency Hz.
std::string_view si_unit(Quantity quantity);
/// Name in words, e.g. "displacement".
std::string_view to_string(Quantity quantity);

/// How an amplitude is stated. Every printed amplitude says which.
enum class AmplitudeKind { peak, peak_to_peak, rms };
std::string_view to_string(AmplitudeKind kind);

}  // namespace whirl
