#pragma once
#include <string>
#include <vector>

namespace whirl::shaft {

/// An accelerometer on a body. It measures across the shaft, and gravity where the body tilts: at 1 Hz the tilt gives
/// as much as the motion. Positions run upwards.
struct Accelerometer {
  std::string name, body;
  double position = 0;  ///< m
  double angle = 0;     ///< of its axis, rad, from x towards y
};

/// Half widths within which a machine is as its file says; the truth lies evenly between.
struct CentrifugeTolerance {
  double mount_stiffness = 0;  ///< relative, of all supports of bodies on the ground together
  double mount_damping = 0;    ///< the same
  double sensor_gain = 0;      ///< relative, of each sensor
  double sensor_angle = 0;     ///< rad, of each sensor
};

/// What a rotor file says of it as a centrifuge: [centrifuge] and [[accelerometer]].
struct CentrifugeSetup {
  double plane = 0;         ///< of the buckets' centres of mass along the shaft, m
  double radius = 0;        ///< of these, m; 0: the file has no [centrifuge]
  int buckets = 4;          ///< at equal angles
  double first_bucket = 0;  ///< angle of bucket 1 from the shaft's mark, with the rotation, rad
  double allowed = 0;       ///< imbalance at `radius` with which the machine may pass its critical speeds, kg
  double load = 0;          ///< mass of all tubes at most, kg; anything from none to this turns with the bowl
  std::vector<Accelerometer> accelerometers;
  CentrifugeTolerance tolerance;

  bool given() const { return radius > 0; }
};

}  // namespace whirl::shaft
