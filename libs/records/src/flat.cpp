#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "channel.hpp"

namespace whirl::records::detail {
namespace {

struct Run {
  Eigen::Index first, length;
};

double range(const Eigen::VectorXd& v, Eigen::Index first, Eigen::Index length) {
  const auto s = v.segment(first, length);
  return s.maxCoeff() - s.minCoeff();
}

/// How far the signal moves right before and after a stretch, within as many samples as the stretch has (40 at most: a
/// motion that dies away comes to rest slowly). A turning point of a smooth quantised curve that stays within one
/// quantum moves at most 12 quanta there (a parabola, three samples); a stretch that was held moves as the signal does.
struct Beside {
  double before = 0, after = 0;
  bool has_before = false, has_after = false;
};
Beside beside(const Eigen::VectorXd& v, const Run& r) {
  Beside b;
  const Eigen::Index length = std::clamp<Eigen::Index>(r.length, 2, 40);
  if (r.first >= length) {
    b.before = range(v, r.first - length, length);
    b.has_before = true;
  }
  if (r.first + r.length + length <= v.size()) {
    b.after = range(v, r.first + r.length, length);
    b.has_after = true;
  }
  return b;
}

constexpr double kQuanta = 16;  // beyond the 12 of a parabola

/// Whether single samples turn at exactly the same value again and again: a fast signal is cut off for no longer than a
/// sample. Values near the limit that recur as often (a coarse converter, a tone at a simple share of the rate) are
/// against it; the top of a sine takes 2.4 times the samples of the level below.
bool turns_at(const ChannelCheck& c, double level, double least) {
  constexpr Eigen::Index kTurns = 8, kOftener = 5;
  const Eigen::VectorXd& v = c.samples;
  Eigen::Index turns = 0;
  for (Eigen::Index i = 1; i + 1 < v.size(); ++i)
    turns += v[i] == level && c.usable[i] && std::abs(v[i - 1] - level) > least && std::abs(v[i + 1] - level) > least;
  if (turns < kTurns) return false;
  std::vector<double> near;
  const double reach = 0.2 * (v.maxCoeff() - v.minCoeff());
  for (Eigen::Index i = 0; i < v.size(); ++i)
    if (c.usable[i] && v[i] != level && std::abs(v[i] - level) < reach) near.push_back(v[i]);
  std::sort(near.begin(), near.end());
  Eigen::Index most = 1;
  for (std::size_t i = 0, begin = 0; i < near.size(); ++i) {
    if (near[i] != near[begin]) begin = i;
    most = std::max<Eigen::Index>(most, static_cast<Eigen::Index>(i - begin) + 1);
  }
  return static_cast<Eigen::Index>(near.size()) > turns && turns > kOftener * most;
}

void find_clipping(ChannelCheck& c, const std::vector<Run>& runs, bool upper) {
  const double level = upper ? c.samples.maxCoeff() : c.samples.minCoeff();
  const double least = std::max(kQuanta * c.quantum, 1e-9 * c.spread);
  Eigen::Index evidence = 0;
  for (const Run& r : runs) {
    if (c.samples[r.first] != level || r.length < 3) continue;
    const Beside b = beside(c.samples, r);
    const double moves = std::min(b.has_before ? b.before : b.after, b.has_after ? b.after : b.before);
    if (moves > least) evidence += r.length;
  }
  if (evidence < 4 && !turns_at(c, level, least)) return;
  Eigen::Index count = 0, first = -1, last = 0;
  for (Eigen::Index i = 0; i < c.samples.size(); ++i) {
    if (c.samples[i] != level || !c.usable[i]) continue;
    if (first < 0) first = i;
    last = i;
    ++count;
    c.usable[i] = false;
  }
  Finding f{.kind = FindingKind::clipping, .severity = Severity::mask, .samples = count, .size = level};
  f.advice = "readings at the limit are left out; a larger measuring range keeps the peaks";
  c.report(std::move(f), first, last);
}

/// Distance of a level from the nearest reading that is at neither of the levels.
struct Others {
  double low = std::numeric_limits<double>::infinity(), high = -low;  ///< their range
  double step = 0;                                                    ///< their largest from one sample to the next
  double apart(double level) const { return std::max(level - high, low - level); }
};

Others others_than(const ChannelCheck& c, double lowest, double highest) {
  Others o;
  double last = std::numeric_limits<double>::quiet_NaN();
  for (Eigen::Index i = 0; i < c.samples.size(); ++i) {
    const double value = c.samples[i];
    const bool other = c.usable[i] && value != lowest && value != highest;
    if (other) {
      o.low = std::min(o.low, value), o.high = std::max(o.high, value);
      if (!std::isnan(last)) o.step = std::max(o.step, std::abs(value - last));
    }
    last = other ? value : std::numeric_limits<double>::quiet_NaN();
  }
  return o;
}

}  // namespace

void find_out_of_reach(ChannelCheck& c) {
  constexpr double kSteps = 3;       // of the largest: a signal comes to its limit by its own slope
  constexpr double kRange = 0.5;     // of the range of the others
  for (bool again = true; again;) {  // beyond the one value may lie another
    again = false;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (Eigen::Index i = 0; i < c.samples.size(); ++i)
      if (c.usable[i]) low = std::min(low, c.samples[i]), high = std::max(high, c.samples[i]);
    if (!(high > low)) return;
    const Others others = others_than(c, low, high);
    for (const double level : {low, high}) {
      const double least = std::max(kSteps * others.step, kRange * (others.high - others.low));
      if (!(others.high > others.low) || !(others.apart(level) > least)) continue;
      Eigen::Index count = 0, first = -1, last = 0, longest = 0, length = 0;
      for (Eigen::Index i = 0; i < c.samples.size(); ++i) {
        length = c.usable[i] && c.samples[i] == level ? length + 1 : 0;
        if (length == 0) continue;
        longest = std::max(longest, length);
        if (first < 0) first = i;
        last = i;
        ++count;
      }
      constexpr double kFew = 0.1;
      if (longest < 2 || static_cast<double>(count) > kFew * static_cast<double>(c.samples.size())) continue;
      c.usable = c.usable && c.samples.array() != level;
      Finding f{.kind = FindingKind::spikes, .severity = Severity::mask, .samples = count, .size = level};
      f.advice = fmt::format(
          "they read {:.4g}, which no motion here reaches from one sample to the next: no readings; they are left out",
          level);
      c.report(std::move(f), first, last);
      again = true;
    }
  }
  c.bridge();
}

void find_flat(ChannelCheck& c) {
  const Eigen::VectorXd& v = c.samples;
  const Eigen::Index n = v.size();
  std::vector<Run> runs;  // of equal usable samples
  for (Eigen::Index i = 0; i < n;) {
    Eigen::Index end = i + 1;
    while (end < n && v[end] == v[i] && c.usable[end] && c.usable[i]) ++end;
    if (end - i > 1 && c.usable[i]) runs.push_back({i, end - i});
    i = end;
  }
  const double high = v.maxCoeff(), low = v.minCoeff();
  const double least = std::max(kQuanta * c.quantum, 1e-9 * c.spread);
  constexpr Eigen::Index kShortest = 12, kShortestAtEnd = 50;
  for (const Run& r : runs) {
    const double value = v[r.first];
    if (r.length < kShortest) continue;
    const bool ends = r.first + r.length == n;
    if (ends && r.length < kShortestAtEnd) continue;
    const Beside b = beside(v, r);
    // Rest before something starts is not a frozen sensor; a signal that stops dead at the end is.
    if (!b.has_before || b.before <= least || (!ends && b.has_after && b.after <= least)) continue;
    const bool extreme = value == high || value == low;
    // A plateau at the limit that is no longer than others there is clipping.
    if (extreme) {
      Eigen::Index others = 0;
      for (const Run& o : runs) {
        if (&o != &r && v[o.first] == value && 10 * o.length >= r.length) ++others;
      }
      if (others > 0) continue;
    }
    Finding f{
        .kind = value == 0 ? FindingKind::dropout : FindingKind::frozen, .severity = Severity::mask, .size = value};
    f.advice = "the readings are frozen while the signal moves; they are left out";
    c.report(std::move(f), r.first, r.first + r.length - 1);
  }
  std::erase_if(runs, [&](const Run& r) { return !c.usable[r.first]; });
  if (std::isfinite(high) && high > low) {
    find_clipping(c, runs, true);
    find_clipping(c, runs, false);
  }
  c.bridge();
}

}  // namespace whirl::records::detail
