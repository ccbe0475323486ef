#pragma once
#include <Eigen/Core>

namespace whirl::control {

/// x' = A x + B1 w + B2 u,  (z, u) = (C1 x, u) wanted small,  y = C2 x + n measured; (w, n) disturb. Inputs, outputs
/// and noise are scaled, so that what couples them directly is 1 (the normalised problem of the source).
struct WeightedPlant {
  Eigen::MatrixXd a, b1, b2, c1, c2;
};

/// u = K y, q' = A q + B y, u = C q: the central controller whose closed loop from (w, n) to (z, u) has an H-infinity
/// norm below `norm`, `slack` times the least that any controller reaches.
struct HInfinity {
  Eigen::MatrixXd a, b, c;
  double least = 0, norm = 0;
};

/// Two Riccati equations and a bisection: Doyle, Glover, Khargonekar, Francis, IEEE Trans. AC 34 (1989) 831. Throws
/// Error where no level is reached: something unstable is not controlled or not measured.
HInfinity solve_hinfinity(const WeightedPlant& plant, double slack = 1.05);

}  // namespace whirl::control
