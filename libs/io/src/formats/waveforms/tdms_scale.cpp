#include "formats/waveforms/tdms_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace whirl::io {
namespace {

class Scales {
 public:
  Scales(const TdmsProperties& properties, int scale)
      : properties_(properties), prefix_(fmt::format("NI_Scale[{}]_", scale)) {}

  std::string type() const {
    const auto found = properties_.texts.find(prefix_ + "Scale_Type");
    return found == properties_.texts.end() ? "" : found->second;
  }
  double number(const std::string& name, double otherwise) const {
    const auto found = properties_.numbers.find(prefix_ + name);
    return found == properties_.numbers.end() ? otherwise : found->second;
  }

 private:
  const TdmsProperties& properties_;
  std::string prefix_;
};

}  // namespace

bool scale_tdms(const TdmsProperties& properties, Eigen::VectorXd& values, std::string& type,
                const std::map<int, Eigen::VectorXd>& raw_of) {
  const auto status = properties.texts.find("NI_Scaling_Status");
  if (status != properties.texts.end() && status->second == "scaled") return true;
  const auto number = properties.numbers.find("NI_Number_Of_Scales");
  // Without the count: a single first scale.
  int count = number != properties.numbers.end() ? static_cast<int>(std::clamp(number->second, 0.0, 64.0)) : 1;
  if (number == properties.numbers.end() && !properties.numbers.contains("NI_Scale[0]_Linear_Slope")) return true;
  std::vector<Eigen::VectorXd> after;
  for (int k = 0; k < count; ++k) {
    const Scales scale(properties, k);
    type = scale.type();
    if (type.empty() && number == properties.numbers.end()) type = "Linear";
    const double source = scale.number(type + "_Input_Source", k == 0 ? -1 : k - 1);
    const bool raw = !(source >= 0 && source < k);
    const Eigen::VectorXd& in = raw ? values : after[static_cast<std::size_t>(source)];
    if (type.empty()) {
      const auto own = raw_of.find(k);
      after.push_back(own == raw_of.end() ? in : own->second);
    } else if (type == "Linear") {
      const double slope = scale.number("Linear_Slope", 1), intercept = scale.number("Linear_Y_Intercept", 0);
      after.push_back(slope * in.array() + intercept);
    } else if (type == "Polynomial") {
      const int terms = static_cast<int>(std::clamp(scale.number("Polynomial_Coefficients_Size", 0), 0.0, 64.0));
      Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(in.size());
      for (int c = terms; c-- > 0;)
        sum = sum * in.array() + scale.number(fmt::format("Polynomial_Coefficients[{}]", c), 0);
      after.push_back(sum.matrix());
    } else {
      return false;
    }
  }
  if (!after.empty() && after.back().allFinite()) values = after.back();
  return true;
}

}  // namespace whirl::io
