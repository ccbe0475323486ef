#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/core/angle_signal.hpp"
#include "whirl/core/rotor_model.hpp"
#include "whirl/identify/rotor_terms.hpp"

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

/// The main mode at the samples.
struct MainMotion {
  Eigen::VectorXcd z, v;  ///< m, m/s
  Eigen::VectorXcd a;     ///< m/s^2, by the equation of motion; only where the channels read it

  /// What channels of that derivative read of it.
  const Eigen::VectorXcd& read(int derivative) const { return derivative == 0 ? z : derivative == 1 ? v : a; }
};

/// e^{i beta} and, where a term asks for it, e^{2 i beta} on a grid: worked out once, not in every stage of every step.
struct Turns {
  Eigen::VectorXcd once, twice;
};

/// Forces beyond RotorModel, with the angle on the grid of the forcing and the time of sample 0 that they may depend
/// on.
struct TermForces {
  const std::vector<RotorTerm>& terms;
  const AngleSignal& angle;
  double t0;
  const Eigen::VectorXcd* known = nullptr;  ///< acceleration on that grid, m/s^2; may be null
  const Turns* turns = nullptr;             ///< of the angle; may be null
  bool any() const { return !terms.empty() || known != nullptr; }
  TermPoint point(double x, double y, double vx, double vy, Eigen::Index half, double half_step) const {
    return {x,
            y,
            vx,
            vy,
            angle.omega[half],
            angle.beta[half],
            t0 + half_step * static_cast<double>(half),
            angle.alpha[half],
            turns != nullptr ? &turns->once[half] : nullptr,
            turns != nullptr && turns->twice.size() > 0 ? &turns->twice[half] : nullptr};
  }
};

/// Of each term the lane of its reference beyond those of the coefficients, in the order of the entries that have one;
/// -1: not estimated.
std::vector<Eigen::Index> reference_lanes(const std::vector<RotorTerm>& terms);

struct Sensitivities {
  MainMotion motion;
  /// d x / d p and d y / d p, of the derivative that the channels read, in the rows of the samples, lanes in the
  /// columns; row-major as the integration writes.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> dx, dy;
  bool finite = true;
};

constexpr int kMostLanes = 32;

/// Time grid of an integration: a sample is `substeps` steps, and what acts is given at the ends and the middle of
/// each step, 2 substeps (N - 1) + 1 values for N samples.
struct StepGrid {
  double dt;  ///< of the samples, s
  int substeps = 1;
  int derivative = 0;  ///< of the displacement that the channels read: 1 velocity, 2 acceleration
  double step() const { return dt / substeps; }
  Eigen::Index samples(Eigen::Index values) const { return (values - 1) / (2 * substeps) + 1; }
};

/// RK4 of the main mode and its sensitivities. `forcing`: F on the grid. `profile`: derivative of F by the angle
/// corrections on the grid, one column each (may have none); then follows one lane for each of `terms`, and one for the
/// reference of each entry that has it estimated. z0, dz0:
/// initial state. At most kMostLanes lanes. The second form writes into `out` and keeps its memory.
Sensitivities main_mode_sensitivities(const RotorModel& model, std::complex<double> eps,
                                      const Eigen::VectorXcd& forcing, const Eigen::MatrixXcd& profile,
                                      const TermForces& terms, const StepGrid& grid, std::complex<double> z0,
                                      std::complex<double> dz0);
void main_mode_sensitivities(const RotorModel& model, std::complex<double> eps, const Eigen::VectorXcd& forcing,
                             const Eigen::MatrixXcd& profile, const TermForces& terms, const StepGrid& grid,
                             std::complex<double> z0, std::complex<double> dz0, Sensitivities& out);
/// The motion alone.
MainMotion main_mode(const RotorModel& model, std::complex<double> eps, const Eigen::VectorXcd& forcing,
                     const TermForces& terms, const StepGrid& grid, std::complex<double> z0, std::complex<double> dz0);

}  // namespace whirl::identification::detail
