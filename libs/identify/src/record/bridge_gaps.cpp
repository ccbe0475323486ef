#include "record/bridge_gaps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/evidence.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification::detail {
namespace {

constexpr Eigen::Index kMostInARow = 2;
constexpr double kMostShare = 0.05;

/// Samples on either side that the curve goes through: two, whose curve is about as noisy as a sample, or four of a
/// channel with next to no noise.
Eigen::Index half_width(const Eigen::VectorXd& x) {
  constexpr double kCalm = 1e-4;
  Eigen::Index first = 0, begin = 0, count = 0;
  for (Eigen::Index i = 0; i <= x.size(); ++i) {
    if (i < x.size() && std::isfinite(x[i])) continue;
    if (i - first > count) {
      begin = first;
      count = i - first;
    }
    first = i + 1;
  }
  const Eigen::VectorXd longest = x.segment(begin, count);
  if (count < 32) return 2;
  const double spread = std::sqrt((longest.array() - longest.mean()).square().mean());
  return signal::noise_sd(longest) < kCalm * spread ? 4 : 2;
}

/// Value at `at` of the polynomial through the `half` samples before `first` and from `end` on.
double through_neighbours(const Eigen::VectorXd& x, Eigen::Index first, Eigen::Index end, Eigen::Index half,
                          Eigen::Index at) {
  std::vector<Eigen::Index> points;
  for (Eigen::Index k = 0; k < half; ++k) points.insert(points.end(), {first - 1 - k, end + k});
  double sum = 0;
  for (const Eigen::Index k : points) {
    double weight = 1;
    for (const Eigen::Index other : points) {
      if (other != k) weight *= static_cast<double>(at - other) / static_cast<double>(k - other);
    }
    sum += weight * x[k];
  }
  return sum;
}

/// Mean rate of a continuous angle over the finite samples of at most `reach` from `from` on, backwards or forwards,
/// rad a sample.
double rate_near(const Eigen::VectorXd& y, Eigen::Index from, int direction, Eigen::Index reach) {
  Eigen::Index to = from;
  while (std::abs(to - from) < reach && to + direction >= 0 && to + direction < y.size() &&
         std::isfinite(y[to + direction]))
    to += direction;
  return to == from ? std::numeric_limits<double>::quiet_NaN() : (y[to] - y[from]) / static_cast<double>(to - from);
}

}  // namespace

void bridge_angle(const Channel& read, Recording& recording, Summary& summary) {
  constexpr Eigen::Index kReach = 40;
  const Eigen::Index n = read.samples.size();
  const Eigen::Index missing = n - (read.samples.array().isFinite()).count();
  if (missing == 0) return;
  Eigen::VectorXd y = read.samples;
  for (Eigen::Index i = 1; i < n; ++i) {  // continuous on each stretch
    if (std::isfinite(y[i]) && std::isfinite(y[i - 1])) y[i] -= kTwoPi * std::round((y[i] - y[i - 1]) / kTwoPi);
  }
  // Over one or two missing readings less than half a turn passes.
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    if (std::isfinite(y[i]) || !std::isfinite(y[i - 1])) continue;
    const Eigen::Index end = std::isfinite(y[i + 1]) ? i + 1 : i + 2;
    if (end >= n || !std::isfinite(y[end])) continue;
    const double turned = kTwoPi * std::round((y[end] - y[i - 1]) / kTwoPi);
    for (Eigen::Index k = end; k < n && std::isfinite(y[k]); ++k) y[k] -= turned;
    for (Eigen::Index k = i; k < end; ++k)
      y[k] = y[i - 1] + (y[end] - y[i - 1]) * static_cast<double>(k - i + 1) / static_cast<double>(end - i + 1);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (std::isfinite(y[i])) continue;
    Eigen::Index end = i;
    while (end < n && !std::isfinite(y[end])) ++end;
    const double before = i > 0 ? rate_near(y, i - 1, -1, kReach) : NAN,
                 after = end < n ? rate_near(y, end, 1, kReach) : NAN;
    if (!std::isfinite(before) || !std::isfinite(after)) {
      throw Error(fmt::format("{}: channel {} is missing from {:.4g} s at an end of the record: cut that off (--rows)",
                              recording.source, read.name, recording.t0 + recording.dt * static_cast<double>(i)));
    }
    const double steps = static_cast<double>(end - i + 1), reach = 0.5 * static_cast<double>(kReach);
    // Speeds hold in the middle of the stretches they come from.
    const double slope = (after - before) / (steps + 2 * reach);
    const double first = before + slope * reach, last = after - slope * reach, expected = 0.5 * (first + last) * steps;
    const double turns = std::round((expected - (y[end] - y[i - 1])) / kTwoPi);
    for (Eigen::Index k = end; k < n && std::isfinite(y[k]); ++k) y[k] += turns * kTwoPi;
    const double a = y[i - 1], b = y[end];
    for (Eigen::Index k = i; k < end; ++k) {
      const double s = static_cast<double>(k - i + 1) / steps;
      y[k] = a * (1 + 2 * s) * (1 - s) * (1 - s) + b * s * s * (3 - 2 * s) +
             steps * (first * s * (1 - s) * (1 - s) - last * s * s * (1 - s));
    }
    i = end;
  }
  for (Channel& c : recording.channels) {
    if (c.name == read.name) c.samples = std::move(y);
  }
  summary.warn(fmt::format("channel {}: {} missing samples are read off the angle and the speed beside them", read.name,
                           missing));
}

Recording with_single_gaps_bridged(const Recording& record, Summary& summary) {
  Recording out = record;
  for (Channel& c : out.channels) {
    const Eigen::VectorXd x = c.samples;
    const Eigen::Index n = x.size(), missing = n - x.array().isFinite().count();
    if (missing == 0 || static_cast<double>(missing) > kMostShare * static_cast<double>(n)) continue;
    const Eigen::Index most = half_width(x);
    Eigen::Index bridged = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (std::isfinite(x[i])) continue;
      Eigen::Index end = i;
      while (end < n && !std::isfinite(x[end])) ++end;
      const auto whole = [&](Eigen::Index half) {
        return i >= half && end + half <= n && x.segment(i - half, half).allFinite() &&
               x.segment(end, half).allFinite();
      };
      if (end - i <= kMostInARow && whole(2)) {
        const Eigen::Index half = whole(most) ? most : 2;
        for (Eigen::Index k = i; k < end; ++k) c.samples[k] = through_neighbours(x, i, end, half, k);
        bridged += end - i;
      }
      i = end;
    }
    if (bridged > 0) {
      summary.warn(fmt::format("channel {}: {} single missing samples are read off the curve through their neighbours",
                               c.name, bridged));
    }
  }
  return out;
}

Recording without_empty_ends(const Recording& record, const std::vector<std::string>& states,
                             const std::vector<std::string>& inputs) {
  const auto read = [&](const std::string& name, Eigen::Index i) {
    const Channel* c = record.find(name);
    return c == nullptr || std::isfinite(c->samples[i]);
  };
  const auto says = [&](Eigen::Index i) {
    return std::all_of(inputs.begin(), inputs.end(), [&](const std::string& u) { return read(u, i); }) &&
           std::any_of(states.begin(), states.end(), [&](const std::string& x) { return read(x, i); });
  };
  Eigen::Index first = 0, end = record.size();
  while (first < end && !says(first)) ++first;
  while (end > first && !says(end - 1)) --end;
  return end == first || end - first == record.size() ? record : part_of(record, first, end - first);
}

Recording longest_whole_stretch(const Recording& record) {
  Eigen::Index best = 0, at = 0, first = 0;
  for (Eigen::Index i = 0; i <= record.size(); ++i) {
    const bool whole = i < record.size() && std::all_of(record.channels.begin(), record.channels.end(),
                                                        [&](const Channel& c) { return std::isfinite(c.samples[i]); });
    if (whole) continue;
    if (i - first > best) {
      best = i - first;
      at = first;
    }
    first = i + 1;
  }
  return best == record.size() ? record : part_of(record, at, best);
}

}  // namespace whirl::identification::detail
