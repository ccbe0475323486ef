#pragma once
#include <Eigen/Core>
#include <complex>

#include "whirl/response/periodic_system.hpp"

namespace whirl::response {

/// Which parameter a curve runs over; the other one stands still.
enum class Parameter { speed, force };

/// A periodic solution q_i(tau) = a0 + sum over k of c_k cos k tau + s_k sin k tau.
struct PeriodicSolution {
  Eigen::MatrixXd coefficients;  ///< 2 H + 1 x coordinates: a0, c1, s1, c2, s2, ...
  double omega = 0;              ///< rad/s
  double force = 0;              ///< unit of the input

  int harmonics() const { return static_cast<int>((coefficients.rows() - 1) / 2); }
  /// c_k - i s_k: the vector of exp(i k tau).
  std::complex<double> harmonic(Eigen::Index coordinate, int k) const;
  /// Coordinates (columns) at `points` equal steps of a period.
  Eigen::MatrixXd orbit(int points) const;
};

/// Residual of the balance and its derivatives at a solution.
struct Balance {
  Eigen::VectorXd residual;
  Eigen::MatrixXd jacobian;  ///< by the coefficients, coordinate by coordinate
  Eigen::VectorXd by_parameter;
};
Balance balance(const PeriodicSystem& system, const PeriodicSolution& solution, Parameter parameter);
/// The residual alone, at less than half the cost.
Eigen::VectorXd balance_residual(const PeriodicSystem& system, const PeriodicSolution& solution);

/// Spectrum of what the kept harmonics leave over: largest missed forcing at harmonics H + 1 .. 2 H over the largest
/// kept one, 0 when the truncation is exact.
double truncation(const PeriodicSystem& system, const PeriodicSolution& solution);

/// Floquet multipliers: eigenvalues of the variational equation over one period.
Eigen::VectorXcd floquet_multipliers(const PeriodicSystem& system, const PeriodicSolution& solution);

/// Newton at fixed parameters from `start`; false when it does not converge in `iterations`.
bool solve_periodic(const PeriodicSystem& system, PeriodicSolution& start, int iterations = 30,
                    double tolerance = 1e-11);

}  // namespace whirl::response
