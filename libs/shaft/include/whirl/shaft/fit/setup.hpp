#pragma once
#include <string>
#include <vector>

#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

/// How the coefficients of a support are looked for: as the file says; one value; a value in the middle of the speeds
/// of the records and a change to their ends; a value at each speed of the support's own table.
enum class OverSpeed { known, constant, linear, table };

/// Half widths within which the drawing is right: the truth lies anywhere between, evenly, so that the standard
/// deviation is the half width over sqrt 3. 0: as drawn.
struct Tolerances {
  double youngs_modulus = 0;  ///< relative, of each material; Poisson's ratio stays
  double diameter = 0;        ///< relative, outer diameter of each section
  double disc_position = 0;   ///< m, of each disc and of the unbalance at its hub
  double disc_mass = 0;       ///< relative, of each disc; moments of inertia with it
  double probe_gain = 0;      ///< relative, and as an angle in rad, of each probe; 0: nothing is known of it
};

/// A known mass on the shaft during one run.
struct Trial {
  std::string run;      ///< name of the run: that of its file without ending
  double position = 0;  ///< m
  double size = 0;      ///< kg m
  double angle = 0;     ///< rad, as of an unbalance
};

/// What of a rotor is unknown. Beside it always the unbalance at the stations of Rotor::unbalances and, of every
/// probe, a complex gain and a runout vector.
struct FitSetup {
  OverSpeed stiffness = OverSpeed::constant;
  OverSpeed damping = OverSpeed::constant;
  std::vector<std::string> supports;  ///< those with unknown coefficients; empty: all
  bool axes_alike = false;            ///< one coefficient for x and y
  bool cross_coupling = false;        ///< xy and yx are unknown too
  bool material_damping = true;       ///< of each material
  bool joint_damping = false;         ///< of each joint
  bool bow = false;                   ///< at each point of Rotor::bow
  Tolerances tolerance;
  std::vector<Trial> trials;
};

}  // namespace whirl::shaft
