#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/shaft/centrifuge/setup.hpp"
#include "whirl/shaft/rotor.hpp"
#include "whirl/shaft/system.hpp"
#include "whirl/shaft/transient.hpp"

namespace whirl::shaft {

/// A support without stiffness or damping: its row reads the motion of its point.
Support observer(const std::string& name, const Point& point);

/// Distance of the two points by which the tilt of a body is read, m.
inline constexpr double kTiltArm = 0.1;
inline constexpr double kGravity = 9.80665;  ///< m/s^2

/// The model of a rotor whose run holds the motion of accelerometers: two rows of `bodies` more for each, its place and
/// one kTiltArm above.
System assemble_with(const Rotor& rotor, const std::vector<Accelerometer>& accelerometers);

/// What the accelerometers of `assemble_with` read along a run, m/s^2, accelerometers x samples: acceleration along the
/// axis by differences of five samples (low by (w dt)^4 / 90 of itself), and gravity where the body tilts.
Eigen::MatrixXd accelerometer_readings(const RotorRun& run, const std::vector<Accelerometer>& accelerometers);

}  // namespace whirl::shaft
