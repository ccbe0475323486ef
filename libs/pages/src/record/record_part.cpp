#include "record/record_part.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "record/record_maps.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/remarks.hpp"
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

namespace {

constexpr Index kShortGap = 3;        // samples that a curve through their neighbours replaces
constexpr double kCloseSamples = 16;  // a turn, for that curve
constexpr double kTurnsAbout = 1.5;   // turns to either side from which the orders are taken
constexpr int kOrdersAbout = 3;

/// The curve through three readings to either side, at `at`; NaN where they are not there.
double by_neighbours(const Eigen::VectorXd& x, const Eigen::ArrayX<bool>& usable, Index at) {
  std::vector<Index> near;
  for (Index k = at - 1; k >= 0 && near.size() < 3; --k)
    if (usable[k]) near.push_back(k);
  const std::size_t left = near.size();
  for (Index k = at + 1; k < x.size() && near.size() < left + 3; ++k)
    if (usable[k]) near.push_back(k);
  if (near.size() < 6) return NAN;
  double sum = 0;
  for (const Index i : near) {
    double weight = 1;
    for (const Index k : near)
      if (k != i) weight *= static_cast<double>(at - k) / static_cast<double>(i - k);
    sum += weight * x[i];
  }
  return sum;
}

/// Replaces samples [first, end) by the mean, the slope and the orders of the readings about them; NaN where fewer than
/// half of these are there.
void by_orders(Eigen::VectorXd& x, const Eigen::ArrayX<bool>& usable, Index first, Index end,
               const diagnosis::Rotation& turning) {
  x.segment(first, end - first).setConstant(NAN);
  const Index begin = turning.first, stop = begin + turning.size();
  if (first < begin || end > stop) return;
  const auto angle = [&](Index i) { return turning.angle[i - begin]; };
  Index low = first, high = end - 1;
  while (low > begin && angle(first) - angle(low) < kTurnsAbout * kTwoPi) --low;
  while (high + 1 < stop && angle(high) - angle(end - 1) < kTurnsAbout * kTwoPi) ++high;
  const auto row = [&](Index i) {
    const double s = static_cast<double>(i - first) / static_cast<double>(high - low + 1);
    Eigen::RowVectorXd r(4 + 2 * kOrdersAbout);
    r.head(4) << 1, s, s * std::cos(angle(i)), s * std::sin(angle(i));
    for (int k = 1; k <= kOrdersAbout; ++k) r.segment(2 + 2 * k, 2) << std::cos(k * angle(i)), std::sin(k * angle(i));
    return r;
  };
  std::vector<Index> known;
  for (Index i = low; i <= high; ++i)
    if (usable[i]) known.push_back(i);
  const auto count = static_cast<Index>(known.size());
  if (2 * count < high - low + 1 || count < 3 * (4 + 2 * kOrdersAbout)) return;
  Eigen::MatrixXd a(count, 4 + 2 * kOrdersAbout);
  Eigen::VectorXd b(count);
  for (Index k = 0; k < count; ++k) {
    a.row(k) = row(known[static_cast<std::size_t>(k)]);
    b[k] = x[known[static_cast<std::size_t>(k)]];
  }
  const Eigen::VectorXd p = a.colPivHouseholderQr().solve(b);
  for (Index i = first; i < end; ++i) x[i] = row(i) * p;
}

}  // namespace

Recording without_bad_samples(Recording record, const records::RecordReport& report,
                              const std::optional<diagnosis::Rotation>& turning) {
  for (Channel& c : record.channels) {
    const records::ChannelMask* mask = report.mask(c.name);
    if (mask == nullptr || !signal::integrations(c.quantity, c.quantity)) continue;
    const Eigen::ArrayX<bool>& usable = mask->usable;
    const Eigen::VectorXd read = c.samples;
    const double per_turn = turning ? kTwoPi / (turning->highest_speed() * record.dt) : kCloseSamples;
    for (Index i = 0; i < read.size(); ++i) {
      if (usable[i] || !std::isfinite(read[i])) continue;
      Index end = i;
      while (end < read.size() && !usable[end] && std::isfinite(read[end])) ++end;
      const bool close = end - i <= kShortGap && per_turn >= kCloseSamples;
      if (turning && !close)
        by_orders(c.samples, usable, i, end, *turning);
      else
        for (Index k = i; k < end; ++k) c.samples[k] = close ? by_neighbours(read, usable, k) : NAN;
      i = end;
    }
  }
  return record;
}

namespace {

std::vector<std::string> said_of_bad_samples(const Recording& record, const records::RecordReport& report) {
  std::vector<std::string> out;
  for (const records::Finding& f : report.findings) {
    const Channel* c = record.find(f.channel);
    if (c == nullptr || f.severity != records::Severity::mask || f.kind == records::FindingKind::gap) continue;
    if (signal::integrations(c->quantity, c->quantity)) out.push_back(f.text());
  }
  return out;
}

}  // namespace

CleanRecord without_bad_samples(Recording record) {
  const records::RecordReport report = records::check(record);
  CleanRecord out{{}, said_of_bad_samples(record, report)};
  for (const std::string& said : out.left_out) io::remark(record.source, said);
  out.record = out.left_out.empty() ? std::move(record)
                                    : without_bad_samples(std::move(record), report, readable_rotation(record));
  return out;
}

Recording with_straight_lines(Recording record) {
  for (Channel& c : record.channels) {
    if (c.samples.hasNaN() && signal::integrations(c.quantity, c.quantity))
      c.samples = diagnosis::gaps_bridged(std::move(c.samples));
  }
  return record;
}

}  // namespace whirl::pages
