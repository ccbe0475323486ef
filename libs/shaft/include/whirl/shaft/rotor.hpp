#pragma once
#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

namespace whirl::shaft {

/// A flexible rotor as drawn: geometry, materials and what carries it. SI throughout; positions run along the shaft
/// from its left end. x is horizontal, y points up, the shaft turns from x to y.

/// How the shear coefficient k of a circular section is found, bore ratio b = inner / outer diameter, nu Poisson's
/// ratio: hutchinson  6 (1+nu)^2 s / ((7 + 12 nu + 4 nu^2) s + 4 (5 + 6 nu + 2 nu^2) b^2), s = (1 + b^2)^2
///             (Hutchinson, J. Appl. Mech. 68, 2001, 87-92);
/// cowper      6 (1+nu) s / ((7 + 6 nu) s + (20 + 12 nu) b^2) (Cowper, J. Appl. Mech. 33, 1966, 335-340);
/// number      as given; none: no shear deflection (Euler-Bernoulli with rotary inertia).
enum class ShearModel { hutchinson, cowper, number, none };

struct Shear {
  ShearModel model = ShearModel::hutchinson;
  double coefficient = 0;  ///< of `number`, in (0, 1]
};
/// The coefficient k; infinity for `none`.
double shear_coefficient(const Shear& shear, double poisson, double bore_ratio);

/// internal_node: deflection cubic, section angle quadratic, both free inside: error of a frequency falls with the
/// fourth power of the element's length. usual: the two inner coordinates are condensed statically, which is the
/// element of rotor programs (static shape functions): fourth order without shear, second with.
enum class ElementKind { internal_node, usual };

struct Material {
  std::string name = "steel";
  double youngs_modulus = 2.1e11;  ///< Pa
  double shear_modulus = 8.1e10;   ///< Pa
  double density = 7800;           ///< kg/m^3
  double damping = 0;              ///< viscous, turns with the shaft: stress = E (strain + damping d strain / dt), s

  double poisson() const { return youngs_modulus / (2 * shear_modulus) - 1; }
};

/// A length of shaft; diameters run linearly from its left to its right end.
struct Section {
  double length = 0;                ///< m
  double outer = 0, outer_end = 0;  ///< diameter, m
  double inner = 0, inner_end = 0;  ///< bore, m; 0: solid
  std::size_t material = 0;         ///< index into Rotor::materials
  int elements = 0;                 ///< 0: by Rotor::elements
};

struct Disc {
  std::string name;
  double position = 0;               ///< of the hub, m
  double mass = 0;                   ///< kg
  double transverse = 0, polar = 0;  ///< moments of inertia about the centre of mass, kg m^2
  double offset = 0;                 ///< centre of mass to the right of the hub, m
  /// Hub and its unbalance to the right of `position`, m: to first order, with the mesh of `position`.
  double moved = 0;
};
/// Mass and moments of a cylinder of this density; position and name are left.
Disc cylinder(double density, double outer, double bore, double thickness);

/// A rigid part that does not turn: motor, casing, foundation. Without `transverse` it moves but does not tilt.
struct Body {
  std::string name;
  double position = 0;    ///< of its centre of mass, m
  double mass = 0;        ///< kg
  double transverse = 0;  ///< moment of inertia for tilting, kg m^2
};

/// Force per displacement, velocity and acceleration, [[xx, xy], [yx, yy]], over speed: linear between the speeds of
/// the table, held beyond them. One entry: the same at every speed.
struct SupportLaw {
  std::vector<double> speeds;                             ///< rad/s, ascending; empty with one entry
  std::vector<Eigen::Matrix2d> stiffness, damping, mass;  ///< N/m, N s/m, kg

  struct Values {
    Eigen::Matrix2d stiffness, damping, mass;
  };
  Values at(double speed) const;
  /// The values do not depend on speed.
  bool constant() const { return stiffness.size() < 2; }
};

/// A point of the shaft, of a body or of the ground.
struct Point {
  std::string part = "shaft";  ///< "shaft", "ground" or the name of a body
  double position = 0;         ///< m
};

/// Bearing, seal, mount or spring: acts on the displacement of `a` relative to `b`.
struct Support {
  std::string name;
  Point a, b;
  SupportLaw law;
  double tilt_stiffness = 0;  ///< N m/rad
  double tilt_damping = 0;    ///< N m s/rad
};

/// Damping of a joint (shrink fit, clutch, hub) that turns with the shaft: a moment against the rate, seen from the
/// turning shaft, at which the slopes of two points of it part.
struct JointDamping {
  double from = 0, to = 0;  ///< m
  double coefficient = 0;   ///< N m s/rad
};

/// Mass times eccentricity at a point, or spread evenly from `position` to `end`.
struct Unbalance {
  double position = 0, end = 0;  ///< m; equal: at a point
  double size = 0;               ///< kg m, in all
  double angle = 0;              ///< rad, from the shaft's angle zero with the rotation
};

/// The shaft's own deflection without load at a point; a natural cubic spline joins the points.
struct BowPoint {
  double position = 0;  ///< m
  double size = 0;      ///< m
  double angle = 0;     ///< rad, as of an unbalance
};

struct Probe {
  std::string name;
  double position = 0;      ///< m
  double angle = 0;         ///< rad, from x towards y
  double runout = 0;        ///< once a turn, m: the reading is motion + runout cos(theta + runout_angle)
  double runout_angle = 0;  ///< rad, theta the angle of the shaft

  double runout_at(double theta) const { return runout * std::cos(theta + runout_angle); }
};

/// Pushes `a` along its direction and `b`, which carries it, back. A magnetic bearing also pulls with its bias current:
/// a stiffness along the direction that is negative.
struct Actuator {
  std::string name;
  Point a, b;
  double angle = 0;           ///< rad, from x towards y
  double force_limit = 0;     ///< N
  double slew = 0;            ///< largest rate of the force, N/s; 0: any
  double bias_stiffness = 0;  ///< N/m, 0 or negative
  double bandwidth = 0;       ///< the force follows what is asked as a first order, rad/s; 0: at once
};

struct Rotor {
  std::string name;
  std::vector<Material> materials{Material{}};
  std::vector<Section> sections;
  std::vector<Disc> discs;
  std::vector<Body> bodies;
  std::vector<Support> supports;
  std::vector<JointDamping> joints;
  std::vector<Unbalance> unbalances;
  std::vector<BowPoint> bow;
  std::vector<Probe> probes;
  std::vector<Actuator> actuators;
  Shear shear;
  ElementKind element = ElementKind::internal_node;
  int elements = 16;       ///< about so many along the shaft, where a section does not say
  double axial_force = 0;  ///< tension along the whole shaft, N
  bool vertical = false;   ///< no weight across the shaft
  /// Code of the finding that takes the trust from values found by a fit, e.g. "model_error"; empty: none does.
  std::string not_trusted;

  double length() const;
  /// Shaft and discs, kg.
  double mass() const;
  /// Polar moment of inertia of the same, kg m^2.
  double polar_inertia() const;
};

/// Throws Error for a rotor that cannot be: what, value, and what is allowed.
void check(const Rotor& rotor);

}  // namespace whirl::shaft
