#pragma once
#include <string>
#include <vector>

#include "whirl/identify/trajectory.hpp"

namespace whirl::identification::detail {

/// Parameters of the driven rotor, in this order.
inline const std::vector<std::string>& drive_parameters() {
  static const std::vector<std::string> names{
      "k1", "k2", "c", "e_re", "e_im", "motor", "motor_slope", "coulomb", "viscous", "drag", "mass_per_inertia"};
  return names;
}

/// Rates of X2, X4 and X6 in X1 .. X6, the drive and the parameters.
struct DriveRates {
  expr::Expr x, y, speed, reaction;  ///< reaction: F_y cos b - F_x sin b times e
};
DriveRates drive_rates(const std::string& drive);

/// The driven rotor as a trajectory model with the channels x, y (offsets estimated) and beta; `drive` empty: coasting.
TrajectoryModel drive_trajectory(const std::string& drive, const std::vector<double>& values,
                                 const std::vector<std::string>& channels);

/// `values` put in for the parameters.
expr::Expr with_values(const expr::Expr& e, const std::vector<double>& values);

}  // namespace whirl::identification::detail
