#include <cmath>

#include "whirl/core/control_types.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/identified_model.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/core/quantity.hpp"
#include "whirl/core/summary.hpp"

namespace whirl {

std::string_view version() { return WHIRL_VERSION; }

std::string_view si_unit(Quantity q) {
  switch (q) {
    case Quantity::time:
      return "s";
    case Quantity::displacement:
      return "m";
    case Quantity::velocity:
      return "m/s";
    case Quantity::acceleration:
      return "m/s^2";
    case Quantity::force:
      return "N";
    case Quantity::angle:
      return "rad";
    case Quantity::angular_velocity:
      return "rad/s";
    case Quantity::angular_acceleration:
      return "rad/s^2";
    case Quantity::frequency:
      return "Hz";
    case Quantity::voltage:
      return "V";
    case Quantity::current:
      return "A";
    case Quantity::pressure:
      return "Pa";
    case Quantity::mass:
      return "kg";
    case Quantity::temperature:
      return "K";
    case Quantity::strain:
    case Quantity::dimensionless:
      return "1";
    case Quantity::torque:
      return "N m";
    case Quantity::stiffness:
      return "N/m";
    case Quantity::cubic_stiffness:
      return "N/m^3";
    case Quantity::damping:
      return "N s/m";
    case Quantity::moment_of_inertia:
      return "kg m^2";
    case Quantity::rate:
      return "1/s";
    case Quantity::rate_squared:
      return "1/s^2";
    case Quantity::force_constant:
      return "N/V";
    case Quantity::specific_energy:
      return "m^2/s^2";
    case Quantity::specific_power:
      return "m^2/s^3";
  }
  return "1";
}

std::string_view to_string(Quantity q) {
  switch (q) {
    case Quantity::time:
      return "time";
    case Quantity::displacement:
      return "displacement";
    case Quantity::velocity:
      return "velocity";
    case Quantity::acceleration:
      return "acceleration";
    case Quantity::force:
      return "force";
    case Quantity::angle:
      return "angle";
    case Quantity::angular_velocity:
      return "angular velocity";
    case Quantity::angular_acceleration:
      return "angular acceleration";
    case Quantity::frequency:
      return "frequency";
    case Quantity::voltage:
      return "voltage";
    case Quantity::current:
      return "current";
    case Quantity::pressure:
      return "pressure";
    case Quantity::mass:
      return "mass";
    case Quantity::temperature:
      return "temperature";
    case Quantity::strain:
      return "strain";
    case Quantity::dimensionless:
      return "dimensionless";
    case Quantity::torque:
      return "torque";
    case Quantity::stiffness:
      return "stiffness";
    case Quantity::cubic_stiffness:
      return "cubic stiffness";
    case Quantity::damping:
      return "damping";
    case Quantity::moment_of_inertia:
      return "moment of inertia";
    case Quantity::rate:
      return "rate";
    case Quantity::rate_squared:
      return "rate squared";
    case Quantity::force_constant:
      return "force constant";
    case Quantity::specific_energy:
      return "specific energy";
    case Quantity::specific_power:
      return "specific power";
  }
  return "?";
}

std::string_view to_string(AmplitudeKind k) {
  switch (k) {
    case AmplitudeKind::peak:
      return "peak";
    case AmplitudeKind::peak_to_peak:
      return "peak-to-peak";
    case AmplitudeKind::rms:
      return "rms";
  }
  return "?";
}

std::string_view to_string(Status s) {
  switch (s) {
    case Status::ok:
      return "ok";
    case Status::warning:
      return "warning";
    case Status::unusable:
      return "unusable";
  }
  return "?";
}

std::string_view to_string(FrfKind k) {
  switch (k) {
    case FrfKind::receptance:
      return "receptance";
    case FrfKind::mobility:
      return "mobility";
    case FrfKind::accelerance:
      return "accelerance";
  }
  return "?";
}

std::string_view to_string(DampingModel model) { return model == DampingModel::viscous ? "viscous" : "hysteretic"; }

std::string_view to_string(Hold hold) {
  switch (hold) {
    case Hold::zero:
      return "zero";
    case Hold::first:
      return "first";
    case Hold::band_limited:
      break;
  }
  return "band-limited";
}

Hold hold_of(std::string_view name) {
  for (const Hold hold : {Hold::band_limited, Hold::zero, Hold::first}) {
    if (to_string(hold) == name) return hold;
  }
  throw Error::in_field("hold", name, "zero, first or band-limited");
}

std::string_view to_string(FrfEstimator e) {
  switch (e) {
    case FrfEstimator::h1:
      return "h1";
    case FrfEstimator::h2:
      return "h2";
    case FrfEstimator::hv:
      return "hv";
  }
  return "?";
}

std::string_view to_string(Fault f) {
  switch (f) {
    case Fault::none:
      return "none";
    case Fault::not_finite:
      return "not_finite";
    case Fault::displacement_limit:
      return "displacement_limit";
    case Fault::stale_sensor:
      return "stale_sensor";
    case Fault::overrun:
      return "overrun";
    case Fault::watchdog:
      return "watchdog";
    case Fault::requested:
      return "requested";
  }
  // Those of the loop (whirl/rt/faults.hpp).
  if (f == Fault{7}) return "gap";
  if (f == Fault{8}) return "implausible";
  if (f == Fault{9}) return "supervision";
  if (f == Fault{10}) return "board_restarted";
  if (f == Fault{11}) return "encoder_stuck";
  if (f == Fault{12}) return "board_lost";
  return "?";
}

double RotorModel::natural_frequency() const { return k1 > 0 ? std::sqrt(k1) : 0.0; }
double RotorModel::damping_ratio() const { return k1 > 0 ? c / (2 * std::sqrt(k1)) : 0.0; }

const Estimate* IdentifiedModel::parameter(const std::string& name) const {
  for (const auto& [key, value] : parameters) {
    if (key == name) return &value;
  }
  return nullptr;
}

double IdentifiedModel::noise_correlation_of(const std::string& state) const {
  for (const auto& [name, value] : noise_correlation) {
    if (name == state) return value;
  }
  return 0;
}

}  // namespace whirl
