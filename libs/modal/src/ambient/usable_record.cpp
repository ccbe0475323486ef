#include "usable_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/records/check.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Mask = Eigen::ArrayX<bool>;
using records::FindingKind;

constexpr double kClipped = 1e-3;  // share of samples at the limit that distorts the correlations
constexpr double kMissing = 0.5;   // share of the record
constexpr Index kBridge = 8;       // samples, bridged by a line
constexpr Index kSpike = 2;        // samples

/// Takes off the rows in which a channel stands still or is missing for longer than a bridge; bridges the rest from
/// `shortest` samples on.
void bridge(Eigen::VectorXd& v, const Mask& usable, Index shortest, Mask& rows) {
  const Index n = v.size();
  for (Index i = 0; i < n;) {
    if (usable[i]) {
      ++i;
      continue;
    }
    Index end = i;
    while (end < n && !usable[end]) ++end;
    if (end - i > kBridge || i == 0 || end == n) {
      rows.segment(i, end - i).setConstant(false);
    } else if (end - i >= shortest) {
      for (Index k = i; k < end; ++k)
        v[k] = v[i - 1] + (v[end] - v[i - 1]) * static_cast<double>(k - i + 1) / static_cast<double>(end - i + 1);
    }
    i = end;
  }
}

/// First sample and length of the longest run of true.
std::pair<Index, Index> longest_run(const Mask& rows) {
  std::pair<Index, Index> best{0, 0};
  for (Index i = 0, begin = 0; i <= rows.size(); ++i) {
    if (i < rows.size() && rows[i]) continue;
    if (i - begin > best.second) best = {begin, i - begin};
    begin = i + 1;
  }
  return best;
}

}  // namespace

Recording usable_record(const Recording& recording, Summary& summary, bool spikes) {
  const records::RecordReport report = records::check(recording);
  Recording kept;
  kept.source = recording.source;
  kept.dt = recording.dt;
  kept.t0 = recording.t0;
  const auto n = static_cast<double>(recording.size());
  Mask rows = Mask::Constant(recording.size(), true);
  int responses = 0, left_out = 0;
  for (const Channel& c : recording.channels) {
    const records::ChannelMask* mask = report.mask(c.name);
    Index clipped = 0;
    for (const records::Finding& f : report.findings) {
      if (f.channel != c.name) continue;
      if (f.kind == FindingKind::clipping) clipped += f.samples;
      if (f.kind == FindingKind::splice || f.kind == FindingKind::jitter) summary.warn(f.text());
    }
    ++responses;
    if (static_cast<double>(clipped) > kClipped * n) {
      summary.warn(
          fmt::format("channel {}: cut off at its limits for {:.2g} % of the time, which makes false modes and "
                      "bends the true: left out; choose a larger measuring range",
                      c.name, 100 * static_cast<double>(clipped) / n));
      ++left_out;
      continue;
    }
    kept.channels.push_back(c);
    if (mask == nullptr || clipped > 0) continue;
    Mask whole = rows;
    bridge(kept.channels.back().samples, mask->usable, spikes ? 1 : kSpike + 1, whole);
    for (const records::Finding& f : report.findings)
      if (f.channel == c.name && f.severity == records::Severity::mask && (spikes || f.kind != FindingKind::spikes))
        summary.warn(fmt::format("channel {}: {} {} samples from {:.4g} to {:.4g} s carry no information", c.name,
                                 f.samples, to_string(f.kind), f.begin, f.end));
    if (static_cast<double>((whole != rows).count()) > kMissing * n) {
      summary.warn(fmt::format("channel {}: left out, it is frozen or missing for most of the record", c.name));
      kept.channels.pop_back();
      ++left_out;
      continue;
    }
    rows = whole;
  }
  const auto [first, count] = longest_run(rows);
  if (left_out == responses || static_cast<double>(count) < 0.1 * n) {
    summary.fail("no part of the record is free of clipping and stretches without information: modes would be false");
    return recording;
  }
  if (count == recording.size()) return kept;
  summary.warn(fmt::format("used: {:.4g} to {:.4g} s, the longest part without such stretches",
                           recording.t0 + static_cast<double>(first) * recording.dt,
                           recording.t0 + static_cast<double>(first + count - 1) * recording.dt));
  kept.t0 = recording.t0 + static_cast<double>(first) * recording.dt;
  for (Channel& c : kept.channels) c.samples = Eigen::VectorXd(c.samples.segment(first, count));
  return kept;
}

}  // namespace whirl::modal
