#pragma once
#include <Eigen/Core>
#include <map>
#include <string>

namespace whirl::io {

/// Properties of a TDMS object whose names begin with NI_.
struct TdmsProperties {
  std::map<std::string, double> numbers = {};
  std::map<std::string, std::string> texts = {};
};

/// Raw values through the chain of scales that the properties state (linear and polynomial ones; a scale without a type
/// hands its input on), as LabVIEW shows them. False, and the values as they were, when one of another type is among
/// them: `type` is its name then. Nothing is done where the status says that the values are scaled already. A scale
/// without a type takes its own raw values where `raw_of` has some under its number (DAQmx devices).
bool scale_tdms(const TdmsProperties& properties, Eigen::VectorXd& values, std::string& type,
                const std::map<int, Eigen::VectorXd>& raw_of = {});

}  // namespace whirl::io
