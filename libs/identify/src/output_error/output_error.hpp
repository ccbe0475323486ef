#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/core/least_squares.hpp"

namespace whirl::identification::detail {

/// Adds the sums of one run, taken over the unknowns that act on it, to those of all runs.
void add_run(const SquareSum& run, const std::vector<Eigen::Index>& unknowns, SquareSum& all);

struct OutputError {
  SquareSum sum;
  DescentReport descent;
  double values = 0;      ///< independent numbers compared
  double freedom = 0;     ///< values less unknowns
  bool diverged = false;  ///< the start does; nothing was done
  double variance() const { return sum.cost / freedom; }
};

/// Output error: free runs against what was measured. `Problem` is one for descend() and stands for a kind of model:
///
///     x' = f(x, u, p), x(0) in p      states, inputs, parameters; one run per record or stretch
///     y  = h(x, u, p)                 output map: what the channels read of the states
///     r  = W (measured - y)           whitening: size and colour of the noise, samples left out, parts projected out
///
/// `linearise` integrates every run with the sensitivities dx/dp, maps both to the channels, whitens them and sums with
/// add_run; `values(sum)` counts the independent numbers. Nothing here knows what f, h and W are: a rotor on measured
/// angles (OutputErrorProblem) and terms of a library (StatesProblem) go through the same descent.
template <class Problem, class Point>
OutputError fit_output_error(Problem& problem, Point& point, int max_iterations) {
  OutputError fit;
  problem.linearise(point, fit.sum);
  fit.values = problem.values();
  fit.freedom = fit.values - static_cast<double>(fit.sum.gradient.size());
  fit.diverged = !std::isfinite(fit.sum.cost);
  if (fit.diverged || !(fit.freedom > 0)) return fit;
  fit.descent = descend(problem, point, fit.sum, max_iterations);
  return fit;
}

}  // namespace whirl::identification::detail
