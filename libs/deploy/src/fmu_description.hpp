#pragma once
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
  int derivative_of = -1;    ///< value reference of the state
  double low = 0, high = 0;  ///< of a parameter; equal: not stated
  bool event = false;        ///< event indicator
};

/// Position in the list is the value reference.
struct FmuDescription {
  std::string title;
  std::vector<FmuVariable> variables;
  double step = 0;  ///< s, proposed communication step
  bool variable_step = true;
};

/// C statements that let the angle inputs of an instance go on for the time `age`.
std::string angle_lines(const ModelSystem& system);

std::string fmu_xml(const FmuDescription& description, const FmuOptions& options, const std::string& token);

}  // namespace whirl::deploy
