#pragma once
#include <complex>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/identify/rotor_record.hpp"
#include "whirl/identify/trajectory.hpp"

/// A disc that tilts as a system whose free runs are followed.
namespace whirl::identification::tilting {

using Complex = std::complex<double>;
inline constexpr Eigen::Index kStates = 8;

/// Parameters, in this order. The fit has `soft` = k1 - couple^2 / tilt, the stiffness with the tilt left free, and the
/// unbalance `heavy` = eps - couple / tilt eps_tilt that acts there, in the place of k1 and eps: the main mode fixes
/// them, while k1, couple and tilt slide along a valley.
enum Parameter { k1, k2, c, couple, eps_re, eps_im, tilt, c_tilt, polar, tilt_re, tilt_im, offset_x, offset_y };
inline constexpr std::size_t kParameters = offset_y + 1;

/// Readings and forcing, every `every`-th sample; what is left out is no number.
Recording run_record(const RotorRecord& record, Eigen::Index every);
TrajectoryModel trajectory_at(std::vector<double> values);
/// Runs of about `length` samples, started from a sine through their first turn, the hidden tilt from its linear whirl.
std::vector<TrajectoryRun> cut(const TrajectoryModel& model, const Recording& record, Eigen::Index length);

/// Value of a parameter of a model that has it.
double number(const IdentifiedModel& model, const char* name);
/// In the order of the parameters.
std::vector<double> values_of(const IdentifiedModel& model);
/// States in the steady whirl of the linear model at a speed and angle.
Eigen::VectorXd steady(const IdentifiedModel& model, double w, double beta);

}  // namespace whirl::identification::tilting
