#include "whirl/identify/rotor_angle.hpp"

#include <algorithm>

#include "whirl/core/error.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::identification {

Recording with_angle_from_pulses(const Recording& record, const std::string& pulses) {
  const Eigen::VectorXd& signal = record[pulses];
  if (!signal.allFinite()) throw Error(fmt::format("{}: channel {} has gaps: no angle", record.source, pulses));
  const signal::AngleFit fit =
      signal::angle_from_pulses(signal::pulse_times(signal, record.dt), record.dt, record.size());
  Recording out = record;
  std::erase_if(out.channels, [&](const Channel& c) { return c.name == "beta" || c.name == pulses; });
  out.add("beta", Quantity::angle, fit.angle.beta(Eigen::seqN(Eigen::Index{0}, record.size(), Eigen::Index{2})));
  return out;
}

}  // namespace whirl::identification
