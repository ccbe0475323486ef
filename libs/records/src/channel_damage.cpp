#include "whirl/records/channel_damage.hpp"

#include <fmt/format.h>

namespace whirl::records {

std::vector<std::string> ChannelDamage::warnings(const Recording& record, double from, double to) const {
  std::vector<std::string> out;
  for (const Finding& f : findings) {
    if (f.end >= record.t0 + from && f.begin <= record.t0 + to)
      out.push_back(fmt::format("{}: {}", record.source, f.text()));
  }
  return out;
}

ChannelDamage channel_damage(const Recording& record, const std::string& channel) {
  Recording alone;
  alone.dt = record.dt;
  alone.t0 = record.t0;
  alone.source = record.source;
  alone.add(channel, Quantity::dimensionless, record[channel]);
  const RecordReport report = check(alone);
  ChannelDamage damage;
  for (const Finding& f : report.findings) {
    using enum FindingKind;
    const bool left_out = f.kind == clipping || f.kind == frozen || f.kind == dropout || f.kind == spikes;
    if (left_out || f.kind == splice) damage.findings.push_back(f);
  }
  if (const ChannelMask* mask = report.mask(channel); mask != nullptr && !damage.findings.empty())
    damage.usable = mask->usable;
  return damage;
}

}  // namespace whirl::records
