#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/rotor_model.hpp"
#include "whirl/core/summary.hpp"

namespace whirl {

/// What the controller receives in one sample period. SI. Trivially copyable.
struct Measurement {
  double t = 0;          ///< time of the control tick, s
  double x = 0, y = 0;   ///< measured displacement of the disk centre, m
  double beta = 0;       ///< rotor angle at the tick, rad, continuous (not wrapped)
  double omega = 0;      ///< rotor speed, rad/s
  double omega_dot = 0;  ///< rotor acceleration, rad/s^2
  bool valid = true;     ///< false: the displacement sample is lost or out of range
};

/// Actuator forces asked for, N.
struct Command {
  double ux = 0, uy = 0;
};

/// Reason why a control step gave no usable command.
enum class Fault : std::uint8_t {
  none = 0,
  not_finite,          ///< a state or input is NaN or infinite
  displacement_limit,  ///< displacement above the trip limit
  stale_sensor,        ///< no valid sample for too long
  overrun,             ///< loop too late too often
  watchdog,
  requested,  ///< stop asked for by the user or a signal
};
std::string_view to_string(Fault fault);

/// A controller as data: everything needed to build it again, in simulation, on hardware or as exported C.
struct ControllerDesign {
  std::string law;                           ///< "tsmc", "pd", ... (names: `whirl design --list`)
  std::string estimator;                     ///< "lpf", "kalman", ...
  std::map<std::string, double> parameters;  ///< of law and estimator, SI, names documented per law
  RotorModel model;                          ///< the identified model that the law uses
  double sample_time = 1e-3;                 ///< h, s
  double delay = 0;         ///< total loop delay assumed (sensor + computation + actuator lag), s, without the hold
  double force_limit = 0;   ///< actuator limit, N
  bool feedforward = true;  ///< uses the unbalance term of f2, f4 (eq. 36)
  std::map<std::string, double> margins;  ///< found by design: delay_margin_s, gain_margin, reach_time_s, ...
  Summary summary;
  Provenance provenance;
};

}  // namespace whirl
