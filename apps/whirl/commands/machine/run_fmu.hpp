#pragma once
#include <map>
#include <string>
#include <vector>

#include "command.hpp"
#include "whirl/rotor/speed_profile.hpp"

namespace whirl::app {

/// The closed loop of a controller with a plant made elsewhere, beside the same plant without control.
struct RunFmuOptions {
  std::vector<std::string> names;  ///< ROLE=VARIABLE of the FMU

  void add_to(CommandLine* sub);
};
/// ROLE=VARIABLE of --fmu-name, by role.
std::map<std::string, std::string> fmu_names(const std::vector<std::string>& roles);
void run_fmu(Session& session, const std::string& controller, const std::string& fmu,
             const rotor::SpeedProfile& profile, const std::string& log, const RunFmuOptions& options);

}  // namespace whirl::app
