#pragma once
#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

/// A support in the coordinates of a plane: it feels the deflection row . q and the tilt tilt . q.
struct Attachment {
  std::string name;
  Eigen::VectorXd row, tilt;  ///< `tilt` is empty where it does not resist tilting
  SupportLaw law;
  double tilt_stiffness = 0, tilt_damping = 0;
};

/// Equations of motion of the rotor in coordinates that are the same for both planes, q = q_x + i q_y. Section angles
/// are dx/dz and dy/dz. For the whole, with Omega the speed and theta the angle of the shaft,
///     M q'' - i Omega G q' + R (q' - i Omega q) + K q + supports = (Omega^2 - i Omega') u e^{i theta} + b e^{i theta}
/// where R is the damping that turns with the shaft (Genta, Dynamics of Rotating Systems, 2005, eqs. 4.1 and 6.20).
/// The moment I_p Omega' of an accelerated disc about the bent axis is left to its drive.
struct System {
  std::vector<double> nodes;   ///< stations of the mesh, m
  Eigen::MatrixXd mass;        ///< M
  Eigen::MatrixXd gyroscopic;  ///< G
  Eigen::MatrixXd stiffness;   ///< K of the shaft
  Eigen::MatrixXd rotating;    ///< R
  std::vector<Attachment> supports;
  Eigen::VectorXcd unbalance;  ///< u, kg m
  Eigen::VectorXcd bow;        ///< b, N
  Eigen::VectorXd weight;      ///< force of a field of 1 m/s^2 along the plane, N
  Eigen::MatrixXd deflection;  ///< nodes x coordinates: deflection at the nodes
  Eigen::MatrixXd slope;       ///< section angle there
  Eigen::MatrixXd bodies;      ///< bodies x coordinates: deflection of their centres
  Eigen::MatrixXd actuators;   ///< actuators x coordinates: deflection of what is pushed from what carries it
  bool vertical = false;
  int free = 0;  ///< motions of rigid parts, in both planes, that no support holds: 4 of a shaft that hangs on strings

  Eigen::Index size() const { return mass.rows(); }
  /// Station nearest to a position.
  Eigen::Index node_at(double position) const;
  /// All supports act alike in every direction at this speed: x'' and y'' join to one complex equation of half the
  /// size.
  bool isotropic(double speed) const;
  /// All supports have the same coefficients at every speed.
  bool constant() const;
};

/// The finite-element model; every station that the rotor names becomes a node. `refinement` splits each element.
/// Throws Error for a rotor that cannot be.
System assemble(const Rotor& rotor, int refinement = 1);

/// Second-order equations at a speed: mass q'' + damping q' + stiffness q = force.
template <class Matrix>
struct Equations {
  Matrix mass, damping, stiffness;
};
/// In (q_x, q_y), real.
Equations<Eigen::MatrixXd> plane_equations(const System& system, double speed);
/// In q_x + i q_y; for an isotropic system.
Equations<Eigen::MatrixXcd> circular_equations(const System& system, double speed);

}  // namespace whirl::shaft
