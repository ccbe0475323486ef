#pragma once
#include <Eigen/Core>
#include <complex>

#include "whirl/core/rotor_model.hpp"

namespace whirl::identification::detail {

using Complex = std::complex<double>;

/// Sensitivity lanes of the main mode, all integrated together in one pass of vector arithmetic.
enum Lane : int {
  kK1,
  kK2,
  kC,
  kEpsRe,
  kEpsIm,
  kX0,
  kY0,
  kVx0,
  kVy0,
  kConjKRe,
  kConjKIm,
  kConjCRe,
  kConjCIm,
  kProfile
};

struct Sensitivities {
  Eigen::VectorXcd z;  ///< main mode at the samples
  /// d x / d p and d y / d p in the rows of the samples, lanes in the columns; row-major as the integration writes.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> dx, dy;
  bool finite = true;
};

/// RK4 of the main mode and its sensitivities. `forcing`: F on the half grid (2 N - 1). `profile`: derivative of F by
/// the angle corrections on the half grid, one column each (may have none). z0, dz0: initial state.
Sensitivities main_mode_sensitivities(const RotorModel& model, std::complex<double> eps,
                                      const Eigen::VectorXcd& forcing, const Eigen::MatrixXcd& profile, double dt,
                                      std::complex<double> z0, std::complex<double> dz0);
/// The motion alone.
Eigen::VectorXcd main_mode(const RotorModel& model, std::complex<double> eps, const Eigen::VectorXcd& forcing,
                           double dt, std::complex<double> z0, std::complex<double> dz0);

}  // namespace whirl::identification::detail
