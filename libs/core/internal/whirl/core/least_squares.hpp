#pragma once
#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <optional>

namespace whirl {

/// A sum of squares |r|^2 of a residual r = measured - model, and its linearisation J = d model / d p.
struct SquareSum {
  double cost = std::numeric_limits<double>::infinity();  ///< r'r; not finite where there is no residual (divergence)
  Eigen::MatrixXd normal;                                 ///< J'J
  Eigen::VectorXd gradient;                               ///< J'r: minus half the slope of the cost
};

/// The one damping rule of all nonlinear least squares here: a step that lowers the cost divides the damping by ten,
/// below 1e-6 it is none at all (Gauss-Newton), a step that does not lower it multiplies it by ten from at least 1e-4.
class Damping {
 public:
  explicit Damping(double start = 0) : value_(start) {}
  double value() const { return value_; }
  void accept() { value_ = value_ < 1e-6 ? 0 : 0.1 * value_; }
  /// False when even a step of 1e-8 of the gradient's does not help: the end of what descent can do.
  bool reject() {
    value_ = std::max(10 * value_, 1e-4);
    return value_ <= 1e8;
  }

 private:
  double value_;
};

/// Solution of a positive definite system, most of which is zero, as that of a fit whose runs have starts of their own:
/// they meet in the coefficients alone, and the factor is as sparse. Nothing where the matrix is small, full or not
/// positive definite.
std::optional<Eigen::MatrixXd> solve_sparse(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right);

/// Step of Levenberg and Marquardt, (N + damping diag N) step = gradient, solved in columns of unit length. A parameter
/// without effect (zero column) stays. False when the matrix is not positive definite.
bool damped_step(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient, double damping, Eigen::VectorXd& step);

/// Inverse of an information matrix in columns of unit length, and what it says of the problem.
struct InverseInformation {
  Eigen::MatrixXd covariance;   ///< empty where the matrix is singular
  double condition_number = 0;  ///< of J with columns of unit length
};
/// Singular: an eigenvalue below 1e-13 of the largest. With `least` > 0 eigenvalues below that share of the largest
/// count as that much, so that a direction which nothing determines gets a large variance.
InverseInformation invert_information(const Eigen::MatrixXd& normal, double least = 0);

/// Information on the first `kept` unknowns once the others are estimated beside them (Schur complement).
Eigen::MatrixXd marginal_information(const Eigen::MatrixXd& normal, Eigen::Index kept);

enum class Descent {
  converged,  ///< the next step was too small to matter
  stalled,    ///< no step along the damped direction lowers the cost
  exhausted,  ///< iterations used up
  singular,   ///< the equations are, even damped
};
struct DescentReport {
  Descent end = Descent::exhausted;
  int iterations = 0;  ///< steps tried, each an evaluation
};

/// Nonlinear least squares by Gauss-Newton steps with Levenberg's damping (columns scaled as in More 1978). `Problem`
/// has
///
///     void linearise(Point&, SquareSum&)   cost, normal matrix and gradient at a point
///     void last(Point&, SquareSum&)        the same after a last small step, or the cost alone
///     Point moved(const Point&, const Eigen::VectorXd& step) const       a step further, within bounds
///     bool small(const SquareSum&, const Eigen::VectorXd& step, double decrease) const
///
/// `small`: a step that lowers the cost by `decrease` does not matter any more; asked before an undamped step with the
/// decrease that the linearisation promises, and after a slightly damped one with that found. `point` and `sum` hold
/// the linearised start and end at the best point; where the cost of the start is not finite nothing is done.
template <class Problem, class Point>
DescentReport descend(Problem& problem, Point& point, SquareSum& sum, int max_iterations, Damping damping = Damping()) {
  DescentReport report;
  Eigen::VectorXd step;
  while (report.iterations < max_iterations && std::isfinite(sum.cost)) {
    if (!damped_step(sum.normal, sum.gradient, damping.value(), step)) {
      if (damping.value() < 1 && damping.reject()) continue;
      report.end = Descent::singular;
      return report;
    }
    ++report.iterations;
    Point trial = problem.moved(point, step);
    SquareSum next;
    if (damping.value() == 0 && problem.small(sum, step, step.dot(sum.normal * step))) {
      next = sum;
      problem.last(trial, next);
      if (next.cost <= sum.cost * (1 + 1e-12)) {
        point = std::move(trial);
        sum = std::move(next);
      }
      report.end = Descent::converged;
      return report;
    }
    problem.linearise(trial, next);
    if (next.cost < sum.cost) {
      const double decrease = sum.cost - next.cost;
      point = std::move(trial);
      sum = std::move(next);
      if (damping.value() > 0 && damping.value() < 1e-2 && problem.small(sum, step, decrease)) {
        report.end = Descent::converged;
        return report;
      }
      damping.accept();
    } else if (!damping.reject()) {
      report.end = Descent::stalled;
      return report;
    }
  }
  return report;
}

}  // namespace whirl
