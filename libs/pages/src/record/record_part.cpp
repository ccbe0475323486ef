#include "record/record_part.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/signal/motion_quantity.hpp"

namespace whirl::pages {

using Eigen::Index;

std::vector<std::string> channels_of(const ViewOptions& o, const Recording& record) {
  if (!o.channels.empty()) return o.channels;
  std::vector<std::string> out;
  for (const char* name : {"x", "y"}) {
    if (record.has(name)) out.emplace_back(name);
  }
  if (!out.empty()) return out;
  std::optional<Quantity> quantity;
  for (const Channel& c : record.channels) {
    if (!signal::integrations(c.quantity, c.quantity) || (quantity && *quantity != c.quantity)) continue;
    quantity = c.quantity;
    out.push_back(c.name);
  }
  if (out.empty() && !record.channels.empty()) out.push_back(record.channels.front().name);
  return out;
}

Recording in_asked_quantity(Recording record, const ViewOptions& o) {
  if (!o.scale.unit) return record;
  // Up to where the flank of the band ends at half the sample rate.
  const signal::Band band{o.lowest_frequency, 0.45 * record.rate()};
  for (Channel& c : record.channels) {
    const auto times = signal::integrations(c.quantity, o.scale.unit->first);
    if (!times || *times == 0) continue;
    c.samples = signal::integrated(c.samples, record.dt, *times, band);
    c.quantity = o.scale.unit->first;
  }
  return record;
}

std::string integration_text(const Channel& channel, const ViewOptions& o) {
  const auto times = o.scale.unit ? signal::integrations(channel.quantity, o.scale.unit->first) : std::nullopt;
  if (!times || *times == 0) return "";
  return fmt::format("{} of {} by {} from {:g} Hz on", to_string(o.scale.unit->first), channel.name,
                     *times > 0 ? "integration" : "differentiation", o.lowest_frequency);
}

std::vector<report::NamedRun> named(const std::vector<ViewedRun>& runs) {
  std::vector<report::NamedRun> out;
  for (const ViewedRun& r : runs) out.push_back({r.name, r.record});
  return out;
}

Recording cut(const Recording& r, const ViewOptions& o) {
  const double n = static_cast<double>(r.size());
  const auto first = static_cast<Index>(std::clamp(std::ceil((o.begin - r.t0) / r.dt - 1e-6), 0.0, n));
  const auto end = static_cast<Index>(std::clamp(std::floor((o.end - r.t0) / r.dt + 1e-6) + 1, 0.0, n));
  if (end - first < 16) {
    const double last = r.t0 + r.dt * (n - 1);
    const std::string part = std::isfinite(o.begin) || std::isfinite(o.end)
                                 ? fmt::format(" between {:g} and {:g} s", std::isfinite(o.begin) ? o.begin : r.t0,
                                               std::isfinite(o.end) ? o.end : last)
                                 : std::string();
    throw Error(fmt::format("{}: {} samples{} (the record lasts from {:g} to {:g} s): must be 16 or more", r.source,
                            std::max<Index>(0, end - first), part, r.t0, last));
  }
  Recording out;
  out.t0 = r.t0 + r.dt * static_cast<double>(first);
  out.dt = r.dt;
  out.source = r.source;
  for (const Channel& c : r.channels) out.add(c.name, c.quantity, c.samples.segment(first, end - first));
  return out;
}

}  // namespace whirl::pages
