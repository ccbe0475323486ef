#pragma once
#include <optional>
#include <string>
#include <vector>

#include "whirl/deploy/fmu.hpp"

namespace whirl::deploy {

/// One variable of an FMU, version independent.
struct FmuVariable {
  enum class Type { real, integer, boolean };
  std::string name, unit, description;
  std::string causality;    ///< input, output, parameter, local, independent
  std::string variability;  ///< continuous, discrete, tunable, fixed
  std::string start;        ///< empty: none
  Type type = Type::real;
  int derivative_of = -1;                             ///< value reference of the state
  double low = 0, high = 0;                           ///< of a parameter; equal: not stated
  bool event = false;                                 ///< event indicator
  double nominal = 0;                                 ///< usual size in its unit; 0: not stated
  std::optional<std::vector<std::size_t>> depends{};  ///< references it is computed from now; none: not stated
};

/// Position in the list is the value reference.
struct FmuDescription {
  std::string title;
  std::vector<FmuVariable> variables;
  double step = 0;  ///< s, proposed communication step
  bool variable_step = true;
  bool directional = false;  ///< directional derivatives are provided
};

/// C statements that let the angle inputs of an instance go on for the time `age`.
std::string angle_lines(const ModelSystem& system);

/// C body that computes `rate` and `output` along changes dx, du of states x and inputs u; symbols p, t, s (signs).
std::string along_lines(const ModelSystem& system, const CodeOptions& options);

std::string fmu_xml(const FmuDescription& description, const FmuOptions& options, const std::string& token);

}  // namespace whirl::deploy
