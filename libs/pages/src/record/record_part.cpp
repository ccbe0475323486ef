#include "record/record_part.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::pages {

using Eigen::Index;

const std::string& channel_of(const ViewOptions& o) {
  static const std::string x = "x";
  return o.channels.empty() ? x : o.channels.front();
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
