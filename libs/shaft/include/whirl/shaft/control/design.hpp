#pragma once
#include <complex>
#include <string>
#include <vector>

#include "whirl/core/summary.hpp"
#include "whirl/shaft/control/controller.hpp"

namespace whirl::shaft {

struct ControlOptions {
  std::string law = "lqg";      ///< see control_laws()
  double from = 0, to = 0;      ///< speeds, rad/s
  double sample_time = 2e-4;    ///< s
  int modes = 6;                ///< of a plane, of the model of the controller
  int schedule = 6;             ///< speeds with gains of their own
  int checked = 25;             ///< speeds at which the loop is looked at
  double sensitivity = 3;       ///< largest allowed peak: zone A of ISO 14839-3
  double adaptation = 2;        ///< of the turning part, 1/s
  double share = 0.8;           ///< of a force limit that the turning part may take
  double force_weight = 0.1;    ///< of the turning forces against the readings
  bool unbalance_known = true;  ///< the turning part begins against the unbalance of the model
};

/// The loop at one speed.
struct ControlPoint {
  double speed = 0;               ///< rad/s
  double open_damping = 0;        ///< least damping ratio of a mode below 1.2 times the highest speed
  double closed_damping = 0;      ///< the same of the closed loop
  double growth = 0;              ///< largest, 1/s
  Eigen::VectorXd sensitivity;    ///< peak over frequency, by actuator
  Eigen::VectorXd turning_force;  ///< once a turn, before anything is learned, N, by actuator
};

/// A controller with one thing changed in the machine.
enum class ControlCase { nominal, rotating_damping, full_model, gain_low, gain_high, delay };
/// As in JSON, e.g. "full_model"; and in words.
std::string to_string(ControlCase c);
std::string to_text(ControlCase c);

struct ControlRefusal {
  ControlCase with = ControlCase::nominal;
  double speed = 0;  ///< rad/s, the first at which it is unstable
};

struct ControlDesign {
  RotorController controller;
  std::vector<ControlPoint> points;
  std::vector<ControlRefusal> refused;  ///< empty: stable in every case at every speed
  double worst_sensitivity = 0;
  double force_noise = 0;       ///< rms force of an actuator for white noise of every probe, at most, N/m
  std::string law;              ///< empty: the controller was given
  std::vector<Amount> numbers;  ///< of the law, found by the search
  Summary summary;
};

/// Laws of the feedback: "lqg", a linear-quadratic regulator with an observer at each speed of the schedule, on the
/// reduced model; "pid", each actuator on its own from the displacement beside it, the same at every speed.
std::vector<std::string> control_laws();

/// Feedback by a law with one sample of delay. Of a grid of its numbers the one with most damping whose sensitivity
/// is allowed and that stays stable in every case. Then the part that turns.
ControlDesign design_rotor_control(const Rotor& rotor, const ControlOptions& options);
/// Looks at a controller on a rotor, which may be another one than it was designed for.
ControlDesign check_rotor_control(const Rotor& rotor, const RotorController& controller, const ControlOptions& options);

/// Zone of a peak of the sensitivity: A below 3, B below 4, C below 5, D (ISO 14839-3).
char sensitivity_zone(double peak);

}  // namespace whirl::shaft
