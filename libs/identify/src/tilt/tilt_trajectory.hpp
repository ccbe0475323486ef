#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/identify/rotor_record.hpp"
#include "whirl/identify/trajectory.hpp"

/// A disc that tilts as a system whose free runs are followed.
namespace whirl::identification::tilting {

using Complex = std::complex<double>;
inline constexpr Eigen::Index kStates = 8;

/// Physical parameters, in this order.
enum Parameter { k1, k2, c, couple, eps_re, eps_im, tilt, c_tilt, polar, tilt_re, tilt_im, offset_x, offset_y };
inline constexpr std::size_t kParameters = offset_y + 1;
using Values = Eigen::Matrix<double, kParameters, 1>;

/// A fit has others, in which its valley is straight: with r = couple / tilt and the hidden motion q / r
///
///     soft = k1 - r couple    the stiffness with the tilt left free, in the place of k1
///     heavy = eps - r eps_tilt, the unbalance that acts there, in the place of eps
///     mass = r^2              what the tilt adds to the mass, in the place of couple
///     give = 1 / tilt, and eps_tilt / r
///
/// The main mode fixes the first two; a record below the upper mode shows the mass, and little of `give` beside it.
Values physical(const Values& fitted);
/// Slopes of `physical`.
Eigen::Matrix<double, kParameters, kParameters> physical_slopes(const Values& fitted);

/// Readings and forcing, every `every`-th sample; what is left out is no number.
Recording run_record(const RotorRecord& record, Eigen::Index every);
TrajectoryModel trajectory_at(Values values);
/// Runs of about `length` samples, started from a sine through their first turn, the hidden tilt from its linear whirl.
std::vector<TrajectoryRun> cut(const TrajectoryModel& model, const Recording& record, Eigen::Index length);

/// Value of a parameter of a model that has it.
double number(const IdentifiedModel& model, const char* name);
/// In the order of the parameters.
Values values_of(const IdentifiedModel& model);
/// States in the steady whirl of the linear model at a speed and angle.
Eigen::VectorXd steady(const IdentifiedModel& model, double w, double beta);
/// The same as `trajectory_at` of its values has them.
Eigen::VectorXd steady_fitted(const IdentifiedModel& model, double w, double beta);

}  // namespace whirl::identification::tilting
