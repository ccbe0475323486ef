#pragma once
#include <Eigen/Core>
#include <vector>

namespace whirl::diagnosis {

/// Vibration after masses w: r = vibration + influence w. Rows are readings (probe at a speed), columns planes; vectors
/// are complex, v = a exp(i phase lead) and w = m exp(i angle with rotation).
struct CorrectionProblem {
  Eigen::MatrixXcd influence;  ///< rows x planes, vibration per unit of mass (or of mass times radius)
  Eigen::VectorXcd vibration;  ///< before
  Eigen::VectorXd weight;      ///< of each row, > 0; empty: all 1
  Eigen::VectorXd limit;       ///< largest |w| of each plane; infinity or empty: none

  Eigen::Index rows() const { return influence.rows(); }
  Eigen::Index planes() const { return influence.cols(); }
  /// vibration + influence w.
  Eigen::VectorXcd residual(const Eigen::VectorXcd& masses) const;
  /// Throws Error when sizes do not fit or a value is not finite or out of range.
  void check() const;
};

/// What is made small: the weighted root of the sum of squares (Goodman 1964), or the largest weighted reading.
enum class Criterion { least_squares, min_max };

struct Correction {
  Eigen::VectorXcd masses;    ///< w
  Eigen::VectorXcd residual;  ///< predicted, unweighted
  double objective = 0;       ///< sqrt(sum weight^2 |r|^2) or max weight |r|
  double bound = 0;      ///< no masses within the limits can be below this (dual bound); objective - bound is the gap
  bool limited = false;  ///< a limit holds a plane
};

/// Value of the criterion.
double objective(const CorrectionProblem& problem, Criterion criterion, const Eigen::VectorXcd& masses);

/// The optimum. Without an active limit least squares is the minimum-norm solution by orthogonal factors; otherwise a
/// second-order cone program (t >= |r|, |w| <= limit; Boyd and Vandenberghe, Convex Optimization, 11.3) solved by a
/// barrier method, whose dual gives `bound`. Relative gap below 1e-6. Throws Error as check().
Correction solve_correction(const CorrectionProblem& problem, Criterion criterion);

/// Planes in the order in which they add something new: Darlow 1982, Gram-Schmidt with the largest column first.
struct PlaneIndependence {
  std::vector<int> order;            ///< planes, the strongest first
  std::vector<double> significance;  ///< by plane: part of its column that the planes before it cannot give, 0..1
  std::vector<int> twin;             ///< by plane: the earlier plane that is most like it, -1 for the first

  /// Planes with a significance of at least `tolerance` (Darlow: 0.2), ascending.
  std::vector<int> independent(double tolerance = 0.2) const;
};
PlaneIndependence plane_independence(const Eigen::MatrixXcd& influence);

/// Where masses can be put on one plane.
struct Places {
  std::vector<double> angles;  ///< of the holes, rad with rotation; empty: any angle
  double piece = 0;            ///< masses come in multiples of this (unit of w); 0: any mass
  double most = 0;             ///< largest mass in one hole; 0: no limit
};
/// What to put where.
struct PlacedMass {
  int plane = 0;
  double angle = 0;  ///< rad, with rotation
  double mass = 0;   ///< unit of w
};
struct Placement {
  std::vector<PlacedMass> masses;
  Eigen::VectorXcd sum;       ///< vector sum on each plane
  Eigen::VectorXcd residual;  ///< predicted
  double objective = 0;
};
/// Puts w on holes and pieces: first the two holes beside each vector (exact where the pieces are fine), then every
/// change of one hole and exchange between two holes that lowers the criterion, over all planes together. `places` has
/// one entry a plane. Throws Error when a plane has fewer than one hole, or angles are not finite.
Placement place_masses(const CorrectionProblem& problem, Criterion criterion, const Eigen::VectorXcd& masses,
                       const std::vector<Places>& places);

}  // namespace whirl::diagnosis
