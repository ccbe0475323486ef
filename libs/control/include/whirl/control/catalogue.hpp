#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/control_types.hpp"

namespace whirl::control {

/// One number of a law, estimator or of the controller around them. SI.
struct ParameterInfo {
  std::string name, unit, meaning;
  double fallback = 0;                 ///< default; NaN: derived from the other parameters, see `meaning`
  double low = 0, high = 0;            ///< admissible range, inclusive
  double tune_low = 0, tune_high = 0;  ///< range of the automatic tuning (logarithmic); equal: not tuned
  /// Default from the other parameters, the sample time h and the samples of delay n, where `fallback` is NaN.
  double (*derive)(const std::map<std::string, double>& values, double h, int n) = nullptr;
};

/// A law or an estimator by name.
struct MethodInfo {
  std::string name, title, source;
  std::vector<ParameterInfo> parameters;
};

const std::vector<MethodInfo>& laws();        ///< ControllerDesign::law
const std::vector<MethodInfo>& estimators();  ///< ControllerDesign::estimator
/// Parameters of every controller: delays, prediction, cancellation, gate, runout.
const std::vector<ParameterInfo>& common_parameters();

/// Throws Error listing the known names when there is none such.
const MethodInfo& law_info(std::string_view name);
const MethodInfo& estimator_info(std::string_view name);

/// Every parameter of the design with defaults filled in and derived ones computed, checked against its range
/// and the conditions between parameters. Throws Error naming the parameter; unknown names are errors too.
std::map<std::string, double> resolve_parameters(const ControllerDesign& design);

/// Advice that is no error: a boundary layer below the delay limit, a regularisation below its limit, and so
/// on.
std::vector<std::string> design_warnings(const ControllerDesign& design);

}  // namespace whirl::control
