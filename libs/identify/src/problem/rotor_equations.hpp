#pragma once
#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/identify/output_error_rotor.hpp"

namespace whirl::identification::detail {

/// Estimates of linear combinations of the fitted parameters, covariance scaled.
class ParameterView {
 public:
  ParameterView(const OutputErrorFit& fit, double covariance_scale) : fit_(fit), scale_(covariance_scale) {}

  using Combination = std::vector<std::pair<double, std::string>>;
  bool has(const std::string& name) const { return fit_.index(name) >= 0; }
  /// sum of factor * parameter; parameters that were not estimated count as 0.
  Estimate sum(const Combination& terms) const;
  Estimate operator[](const std::string& name) const { return sum({{1.0, name}}); }
  /// |re + i im| and its phase, first-order propagation.
  std::pair<Estimate, Estimate> polar(const std::string& re, const std::string& im) const;
  double covariance(const std::string& a, const std::string& b) const;
  double covariance(const Combination& a, const Combination& b) const;

 private:
  const OutputErrorFit& fit_;
  double scale_;
};

/// How the probes read, among the parameters of a model.
SensorAxes sensor_of(const IdentifiedModel& model);

/// What the parameters of the sensors' zero are called before "_x": "offset", "offset_velocity", "offset_acceleration".
std::string offset_name(Quantity quantity);

/// states, inputs, equations, parameters and rotor_covariance of the model from the fit.
void describe_rotor(const ParameterView& view, const OutputErrorFit& fit, IdentifiedModel& model);

/// `parameter_covariance` of the model: that of the fit, first order in what follows from several parameters (e,
/// e_phase, natural frequency, damping ratio), widened to the intervals of `parameters` and to `rotor_covariance`.
/// Rows of parameters that were not estimated are 0.
void join_covariance(const ParameterView& view, IdentifiedModel& model);

using NamedEstimates = std::vector<std::pair<std::string, Estimate>>;
/// The coefficients of the equations follow parameters whose intervals were widened since they stood as `before`: what
/// was added to the variance of k1, k2, c, e and e_phase is added to the coefficients made of them.
void widen_equations(const NamedEstimates& before, IdentifiedModel& model);

}  // namespace whirl::identification::detail
