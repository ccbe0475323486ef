#pragma once
#include <Eigen/Core>

#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

/// Rows that give slope of the deflection and of the section angle (curvature) at an end.
struct EndSlopes {
  Eigen::VectorXd deflection, angle;
};
/// One element in one plane. Coordinates: deflection and section angle at the left end, the same at the right end, and
/// (internal_node) two inner ones.
struct Element {
  Eigen::MatrixXd stiffness, mass, gyroscopic;
  Eigen::MatrixXd geometric;  ///< integral of w'^2, times the axial force
  Eigen::VectorXd load;       ///< of a force of 1 N/m
  EndSlopes left, right;
};
/// Length, diameters at both ends.
struct ElementShape {
  double length, outer_left, outer_right, inner_left, inner_right;
};
Element make_element(const ElementShape& shape, const Material& material, const Shear& shear, ElementKind kind);

}  // namespace whirl::shaft
