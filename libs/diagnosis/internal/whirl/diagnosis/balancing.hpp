#pragma once
#include <complex>
#include <optional>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/rotor_model.hpp"

namespace whirl::diagnosis {

/// What the identified eccentricity says about balancing by hand, one plane.
struct BalancingAdvice {
  double unbalance = 0;            ///< |U| = m e, kg m
  double heavy_angle = 0;          ///< of the heavy spot from the angle zero, rad in (-pi, pi]
  double correction_mass = 0;      ///< to add at `radius`, kg
  double correction_angle = 0;     ///< where to add it: opposite the heavy spot, rad in (-pi, pi]
  double grade = 0;                ///< ISO 21940-11 balance quality G = e omega at service speed, mm/s
  double permitted_unbalance = 0;  ///< for the wanted grade, kg m
  bool within_grade = false;
  std::optional<Estimate> mass_interval;   ///< of `correction_mass`, kg; only with a covariance
  std::optional<Estimate> angle_interval;  ///< of `correction_angle`, rad
};

/// `mass` of the rotor (kg), `radius` of the correction plane (m), `service_speed` (rad/s), `wanted_grade` G
/// in mm/s (ISO 21940-11: 2.5 turbines and pumps of high quality, 6.3 general machines). Throws Error for
/// values <= 0. `covariance`: IdentifiedModel::rotor_covariance (5 x 5, row-major), or empty: no interval.
/// The intervals are those of magnitude and angle within 1.96 standard deviations of the eccentricity in the plane;
/// where this region holds zero the mass begins at 0 and the angle may be any.
BalancingAdvice balancing_advice(const RotorModel& model, double mass, double radius, double service_speed,
                                 double wanted_grade = 6.3, const std::vector<double>& covariance = {});

}  // namespace whirl::diagnosis
