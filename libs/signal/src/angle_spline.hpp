#pragma once
#include <Eigen/Core>

namespace whirl::signal::detail {

/// Least-squares smooth curve through (t, y): a polynomial of degree <= 5 or a uniform quintic B-spline.
class SmoothCurve {
 public:
  static SmoothCurve polynomial(const Eigen::VectorXd& t, const Eigen::VectorXd& y, int degree);
  static SmoothCurve spline(const Eigen::VectorXd& t, const Eigen::VectorXd& y, int intervals);

  /// Value, first and second derivative. Outside the range of t the end polynomial is continued.
  Eigen::Vector3d at(double t) const;
  double value(double t) const { return at(t)[0]; }
  int parameters() const { return static_cast<int>(coefficients_.size()); }
  double rms() const { return rms_; }  ///< of the residual

 private:
  void set_residual(const Eigen::VectorXd& t, const Eigen::VectorXd& y);

  double start_ = 0, width_ = 1;  ///< polynomial: centre and half range; spline: start and interval
  int intervals_ = 0;             ///< 0: polynomial
  Eigen::VectorXd coefficients_;
  double rms_ = 0;
};

}  // namespace whirl::signal::detail
