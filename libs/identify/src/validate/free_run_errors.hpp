#pragma once
#include "whirl/identify/validate.hpp"

/// What every free run of a rotor against its record reports; defined beside `validate`.
namespace whirl::identification::detail {

/// rmse, nrmse and residual over the axes measured. `error`: measured - simulated.
void measure_errors(const RotorRecord& record, const Eigen::VectorXcd& measured, const Eigen::VectorXcd& error,
                    Validation& v);

/// Notes where the constants of x and y fitted to a run, with their deviations, are not those of the model.
void tell_offsets(const IdentifiedModel& model, std::complex<double> fitted, const Eigen::Vector2d& sd, Axes axes,
                  Validation& v);

/// rms error against the noise-free record. Throws Error where it has another length.
void compare_with_clean(Validation& v, const ValidateOptions& options, const Eigen::VectorXcd& simulated);

/// Fold sensitivity from the motion by k2 (1 + fold_change), m rms; warns where the run is.
void judge_fold(Validation& v, const ValidateOptions& options, double shift);

}  // namespace whirl::identification::detail
