#include "whirl/io/info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace whirl {
namespace {

/// Runs of equal neighbouring samples: how many reach `least`, and the longest.
struct Runs {
  long long_ones = 0;
  Eigen::Index longest = 0, longest_at = 0;
};
template <class Accept>
Runs equal_runs(const Eigen::VectorXd& x, Eigen::Index least, Accept accept) {
  Runs out;
  for (Eigen::Index i = 0; i < x.size();) {
    Eigen::Index end = i + 1;
    while (end < x.size() && x[end] == x[i]) ++end;
    if (accept(x[i])) {
      if (end - i >= least) ++out.long_ones;
      if (end - i > out.longest) {
        out.longest = end - i;
        out.longest_at = i;
      }
    }
    i = end;
  }
  return out;
}

/// Smallest non-zero difference of neighbours, and how many neighbours are equal away from the extremes
/// (where a clipped signal rests).
struct Steps {
  double smallest = std::numeric_limits<double>::infinity();
  Eigen::Index equal = 0;
};
Steps neighbour_steps(const Eigen::VectorXd& x, double minimum, double maximum) {
  Steps out;
  for (Eigen::Index i = 1; i < x.size(); ++i) {
    const double d = std::abs(x[i] - x[i - 1]);
    if (d == 0) {
      if (x[i] != minimum && x[i] != maximum) ++out.equal;
    } else {
      out.smallest = std::min(out.smallest, d);
    }
  }
  return out;
}

/// Samples that stand out from both neighbours, in the same direction, by more than 20 times the median jump.
std::pair<long, Eigen::Index> spikes(const Eigen::VectorXd& x) {
  if (x.size() < 16) return {0, 0};
  std::vector<double> jumps(static_cast<std::size_t>(x.size() - 1));
  for (Eigen::Index i = 1; i < x.size(); ++i)
    jumps[static_cast<std::size_t>(i - 1)] = std::abs(x[i] - x[i - 1]);
  const auto middle = jumps.begin() + static_cast<std::ptrdiff_t>(jumps.size() / 2);
  std::nth_element(jumps.begin(), middle, jumps.end());
  const double limit = 20 * *middle;
  long count = 0;
  Eigen::Index first = 0;
  for (Eigen::Index i = 1; i + 1 < x.size() && limit > 0; ++i) {
    const double a = x[i] - x[i - 1], b = x[i] - x[i + 1];
    if (a * b > 0 && std::min(std::abs(a), std::abs(b)) > limit) {
      if (count++ == 0) first = i;
    }
  }
  return {count, first};
}

std::vector<std::string> findings(const Channel& c, const ChannelInfo& info, const Recording& record) {
  std::vector<std::string> out;
  const Eigen::VectorXd& x = c.samples;
  if (info.minimum == info.maximum) {
    out.push_back("constant: the sensor may not be connected");
    return out;
  }
  const auto at = [&](Eigen::Index i) {
    return fmt::format("{:.6g} s", record.t0 + record.dt * static_cast<double>(i));
  };
  const Steps steps = neighbour_steps(x, info.minimum, info.maximum);
  const double range = info.maximum - info.minimum;
  const bool held = static_cast<double>(steps.equal) > 0.2 * static_cast<double>(x.size());
  const double levels = range / steps.smallest;
  if (levels < 64)
    out.push_back(fmt::format("coarse: about {:.0f} levels between minimum and maximum", levels + 1));

  for (const auto& [value, name] : {std::pair{info.maximum, "maximum"}, std::pair{info.minimum, "minimum"}}) {
    const Runs at_end = equal_runs(x, 3, [v = value](double s) { return s == v; });
    if (at_end.long_ones >= 3 && !held && levels >= 64) {
      out.push_back(fmt::format("clipped: the {} {:.6g} {} is held for 3 or more samples {} times", name,
                                value, si_unit(c.quantity), at_end.long_ones));
    }
  }
  // A hold is suspicious when it is much longer than quantisation explains.
  const Runs any = equal_runs(x, 10, [&](double s) { return s != info.minimum && s != info.maximum; });
  if (any.longest >= 10 && !held) {
    out.push_back(fmt::format("frozen: {} equal samples from {} on (lost samples, or standstill?)",
                              any.longest, at(any.longest_at)));
  }
  if (held) {
    out.push_back(
        fmt::format("{:.0f} % of the samples repeat their neighbour: recorded slower than sampled, or coarse",
                    100.0 * static_cast<double>(steps.equal) / static_cast<double>(x.size() - 1)));
  }
  const bool oscillates = c.quantity == Quantity::displacement || c.quantity == Quantity::velocity ||
                          c.quantity == Quantity::acceleration || c.quantity == Quantity::force;
  const double alternating = std::sqrt(std::max(0.0, info.rms * info.rms - info.mean * info.mean));
  if (oscillates && std::abs(info.mean) > 3 * alternating) {
    out.push_back(fmt::format("mean {:.4g} {} is {:.1f} times the alternating rms: remove the offset?",
                              info.mean, si_unit(c.quantity), std::abs(info.mean) / alternating));
  }
  if (const auto [count, first] = spikes(x); count > 0 && !held) {
    out.push_back(fmt::format("{} single-sample spikes, the first at {}", count, at(first)));
  }
  return out;
}

}  // namespace

RecordingInfo describe(const Recording& record) {
  record.check();
  RecordingInfo info{record.source, record.rate(), record.duration(), static_cast<long>(record.size()), {}};
  for (const Channel& c : record.channels) {
    ChannelInfo ci;
    ci.name = c.name;
    ci.quantity = c.quantity;
    if (c.samples.size() > 0) {
      ci.minimum = c.samples.minCoeff();
      ci.maximum = c.samples.maxCoeff();
      ci.mean = c.samples.mean();
      ci.rms = std::sqrt(c.samples.squaredNorm() / static_cast<double>(c.samples.size()));
      ci.findings = findings(c, ci, record);
    }
    info.channels.push_back(std::move(ci));
  }
  return info;
}

std::string to_string(const RecordingInfo& info) {
  std::string out = fmt::format("{}: {} channels, {} samples, {:.9g} Hz, {:.6g} s\n", info.source,
                                info.channels.size(), info.samples, info.rate, info.duration);
  out += fmt::format("{:<12} {:<22} {:>8} {:>12} {:>12} {:>12} {:>12}\n", "channel", "quantity", "unit",
                     "min", "max", "mean", "rms");
  for (const ChannelInfo& c : info.channels) {
    out += fmt::format("{:<12} {:<22} {:>8} {:>12.5g} {:>12.5g} {:>12.5g} {:>12.5g}\n", c.name,
                       to_string(c.quantity), si_unit(c.quantity), c.minimum, c.maximum, c.mean, c.rms);
  }
  for (const ChannelInfo& c : info.channels) {
    for (const std::string& f : c.findings) out += fmt::format("  ! {}: {}\n", c.name, f);
  }
  return out;
}

}  // namespace whirl
