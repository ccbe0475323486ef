#pragma once
#include <Eigen/Core>
#include <vector>

namespace whirl::shaft {

/// Natural cubic spline through points (ascending abscissae, at least two), straight beyond them.
class BowSpline {
 public:
  BowSpline(std::vector<double> x, const Eigen::VectorXcd& y);
  /// Value and slope.
  std::pair<std::complex<double>, std::complex<double>> at(double x) const;

 private:
  std::vector<double> x_;
  Eigen::VectorXcd y_, second_;  // values and second derivatives at the points
};

}  // namespace whirl::shaft
