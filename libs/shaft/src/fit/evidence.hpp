#pragma once
#include "fit/fit_problem.hpp"

namespace whirl::shaft {

/// Noise of every record from the differences of its residual from block to block, in which a misfit that is smooth
/// over speed cancels; sets the weights of the problem.
void renew_noise(FitProblem& problem);

/// Misfit of the residuals of the last linearisation, weighted by `renew_noise`.
FitMisfit misfit_of(const FitProblem& problem, Eigen::Index unknowns);

/// Size of a unit of each unknown of `t` as a part of what it is measured against (FitUnknown::relative_half_width).
Eigen::VectorXd relative_units(const FitProblem& problem, const Eigen::VectorXd& t);

/// Information with what the file states of the geometry, but nothing of gains; a relative half width of 200 (20000 %)
/// stands for none.
Eigen::MatrixXd open_information(const ParameterSet& set, const Eigen::MatrixXd& records, const Eigen::VectorXd& units);

std::vector<WeakDirection> weak_directions(const ParameterSet& set, const Eigen::VectorXd& t,
                                           const Eigen::MatrixXd& information, const Eigen::VectorXd& units);

/// Further runs in the order of what they do for the unknown that is known worst.
std::vector<NextRun> next_runs(const FitProblem& problem, const Eigen::VectorXd& t, const Eigen::VectorXd& units);

}  // namespace whirl::shaft
