#include "whirl/identify/rotor_angle.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "whirl/core/error.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::identification {

Recording with_angle_from_pulses(const Recording& record, const std::string& pulses) {
  const bool found = pulses.empty();
  const Channel* channel = found ? signal::pulse_channel(record) : &record.at(pulses);
  if (channel == nullptr || (found && record.has("beta"))) return record;
  const std::string name = channel->name;
  if (!channel->samples.allFinite()) throw Error(fmt::format("{}: channel {} has gaps: no angle", record.source, name));
  const signal::AngleFit fit =
      signal::angle_from_pulses(signal::pulse_times(channel->samples, record.dt), record.dt, record.size());
  if (found) io::remark(record.source, fmt::format("angle from the once-per-turn pulses of channel {}", name));
  for (const std::string& warning : fit.summary.warnings) io::remark(record.source, warning);
  Recording out = record;
  std::erase_if(out.channels, [&](const Channel& c) { return c.name == "beta" || c.name == name; });
  out.add("beta", Quantity::angle, fit.angle.beta(Eigen::seqN(Eigen::Index{0}, record.size(), Eigen::Index{2})));
  return out;
}

}  // namespace whirl::identification
