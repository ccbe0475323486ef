#pragma once
#include <Eigen/Core>

namespace whirl::rotor {

/// Exact step of q'' + 2 zeta w q' + w^2 q = f over h for an input f that is quadratic through its values at
/// the start, middle and end. No stability limit: w h may be large. T is double or std::complex<double>.
class ModeStep {
 public:
  /// `omega` rad/s (0: a free mass), damping ratio `zeta`, h in s.
  ModeStep(double omega, double zeta, double h);

  template <class T>
  void advance(T& q, T& dq, const T& f0, const T& f_mid, const T& f1) const {
    const T next = state_(0, 0) * q + state_(0, 1) * dq + input_(0, 0) * f0 + input_(0, 1) * f_mid + input_(0, 2) * f1;
    dq = state_(1, 0) * q + state_(1, 1) * dq + input_(1, 0) * f0 + input_(1, 1) * f_mid + input_(1, 2) * f1;
    q = next;
  }

 private:
  Eigen::Matrix2d state_;
  Eigen::Matrix<double, 2, 3> input_;
};

}  // namespace whirl::rotor
