#include "whirl/io/info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

namespace whirl::io {
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

/// Samples that stand out from both neighbours, in the same direction, by more than 20 times the median jump and by
/// four times what these differ from one another and from theirs: the top of a pulse is no spike.
std::pair<long, Eigen::Index> spikes(const Eigen::VectorXd& x) {
  if (x.size() < 16) return {0, 0};
  std::vector<double> jumps(static_cast<std::size_t>(x.size() - 1));
  for (Eigen::Index i = 1; i < x.size(); ++i) jumps[static_cast<std::size_t>(i - 1)] = std::abs(x[i] - x[i - 1]);
  const auto middle = jumps.begin() + static_cast<std::ptrdiff_t>(jumps.size() / 2);
  std::nth_element(jumps.begin(), middle, jumps.end());
  const double limit = 20 * *middle;
  long count = 0;
  Eigen::Index first = 0;
  for (Eigen::Index i = 1; i + 1 < x.size() && limit > 0; ++i) {
    const double a = x[i] - x[i - 1], b = x[i] - x[i + 1];
    const double before = i > 1 ? std::abs(x[i - 1] - x[i - 2]) : 0,
                 after = i + 2 < x.size() ? std::abs(x[i + 1] - x[i + 2]) : 0;
    const double about = 4 * std::max({before, after, std::abs(x[i - 1] - x[i + 1])});
    if (a * b > 0 && std::min(std::abs(a), std::abs(b)) > std::max(limit, about)) {
      if (count++ == 0) first = i;
    }
  }
  return {count, first};
}

void judge_channel(const Channel& c, const Recording& record, ChannelInfo& info) {
  std::vector<std::string>& out = info.findings;
  const Eigen::VectorXd& x = c.samples;
  if (info.minimum == info.maximum) {
    out.push_back("constant: the sensor may not be connected");
    return;
  }
  const auto at = [&](Eigen::Index i) {
    return fmt::format("{:.6g} s", record.t0 + record.dt * static_cast<double>(i));
  };
  const Steps steps = neighbour_steps(x, info.minimum, info.maximum);
  const double range = info.maximum - info.minimum;
  const bool held = static_cast<double>(steps.equal) > 0.2 * static_cast<double>(x.size());
  const double levels = range / steps.smallest;
  if (levels < 64) out.push_back(fmt::format("coarse: about {:.0f} levels between minimum and maximum", levels + 1));

  for (const auto& [value, name] : {std::pair{info.maximum, "maximum"}, std::pair{info.minimum, "minimum"}}) {
    const Runs at_end = equal_runs(x, 3, [v = value](double s) { return s == v; });
    if (at_end.long_ones >= 3 && !held && levels >= 64) {
      info.damage.push_back(fmt::format("clipped: the {} {:.6g} {} is held for 3 or more samples {} times", name, value,
                                        si_unit(c.quantity), at_end.long_ones));
    }
  }
  // A hold is suspicious when it is much longer than quantisation explains.
  const Runs any = equal_runs(x, 10, [&](double s) { return s != info.minimum && s != info.maximum; });
  if (any.longest >= 10 && !held) {
    info.damage.push_back(fmt::format("frozen: {} equal samples from {} on (lost samples, or standstill?)", any.longest,
                                      at(any.longest_at)));
  }
  if (held) {
    out.push_back(fmt::format("{:.0f} % of the samples repeat their neighbour: recorded slower than sampled, or coarse",
                              100.0 * static_cast<double>(steps.equal) / static_cast<double>(x.size() - 1)));
  }
  const bool oscillates = c.quantity == Quantity::displacement || c.quantity == Quantity::velocity ||
                          c.quantity == Quantity::acceleration || c.quantity == Quantity::force;
  const double alternating = std::sqrt(std::max(0.0, info.rms * info.rms - info.mean * info.mean));
  if (oscillates && std::abs(info.mean) > 3 * alternating) {
    out.push_back(fmt::format("mean {:.4g} {} is {:.1f} times the alternating rms: remove the offset?", info.mean,
                              si_unit(c.quantity), std::abs(info.mean) / alternating));
  }
  if (const auto [count, first] = spikes(x); count > 0 && !held) {
    info.damage.push_back(fmt::format("{} single-sample spikes, the first at {}", count, at(first)));
  }
}

}  // namespace

namespace {

ChannelInfo statistics(const std::string& name, const Eigen::VectorXd& samples) {
  ChannelInfo info;
  info.name = name;
  std::vector<double> finite;
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(finite), [](double v) { return std::isfinite(v); });
  if (finite.empty()) return info;
  const Eigen::Map<const Eigen::VectorXd> x(finite.data(), static_cast<Eigen::Index>(finite.size()));
  info.minimum = x.minCoeff();
  info.maximum = x.maxCoeff();
  info.mean = x.mean();
  info.rms = std::sqrt(x.squaredNorm() / static_cast<double>(x.size()));
  return info;
}

std::string channel_lines(const std::vector<ChannelInfo>& channels) {
  std::size_t width = 12;
  for (const ChannelInfo& c : channels) width = std::max(width, c.name.size());
  std::string out = fmt::format("{:<{}} {:<22} {:>8} {:>12} {:>12} {:>12} {:>12}\n", "channel", width, "quantity",
                                "unit", "min", "max", "mean", "rms");
  for (const ChannelInfo& c : channels) {
    const std::string quantity = c.unit == si_unit(c.quantity) ? std::string(to_string(c.quantity)) : "not known";
    out += fmt::format("{:<{}} {:<22} {:>8} {:>12.5g} {:>12.5g} {:>12.5g} {:>12.5g}\n", c.name, width, quantity,
                       c.unit.empty() ? "-" : c.unit, c.minimum, c.maximum, c.mean, c.rms);
  }
  for (const ChannelInfo& c : channels) {
    for (const auto& list : {c.findings, c.damage})
      for (const std::string& f : list) out += fmt::format("  ! {}: {}\n", c.name, f);
  }
  return out;
}

}  // namespace

RecordingInfo describe(const Recording& record) {
  record.check();
  RecordingInfo info{record.source, record.rate(), record.duration(), static_cast<long>(record.size()), {}};
  for (const Channel& c : record.channels) {
    ChannelInfo ci = statistics(c.name, c.samples);
    ci.quantity = c.quantity;
    ci.unit = si_unit(c.quantity);
    if (c.samples.size() > 0) judge_channel(c, record, ci);
    info.channels.push_back(std::move(ci));
  }
  return info;
}

FileInfo describe(const SignalFile& file) {
  FileInfo info{file.source, file.format, {}, file.contents, file.findings};
  for (const SignalTable& table : file.tables) {
    const bool time = table.abscissa == Quantity::time;
    TableInfo ti{table.name,
                 time             ? "time"
                 : table.abscissa ? "frequency"
                                  : "rows",
                 table.start,
                 table.step,
                 static_cast<long>(table.rows()),
                 {}};
    if (table.x.size() > 0)
      info.findings.push_back(fmt::format("the {} values of table '{}' are not uniform", ti.abscissa, table.name));
    if (!table.abscissa && table.rows() > 1)
      info.findings.push_back("no column of time: state the sample rate with --rate HZ to read it as a record");
    Recording axis;
    axis.t0 = table.start;
    axis.dt = table.step > 0 ? table.step : 1;
    for (const Signal& signal : table.signals) {
      const bool complex = signal.imaginary.size() > 0;
      const Eigen::VectorXd shown =
          complex ? Eigen::VectorXd((signal.value.cwiseAbs2() + signal.imaginary.cwiseAbs2()).cwiseSqrt())
                  : signal.value;
      ChannelInfo ci = statistics(signal.name, shown);
      ci.quantity = signal.quantity.value_or(Quantity::dimensionless);
      ci.unit = signal.quantity ? std::string(si_unit(*signal.quantity)) : signal.unit;
      if (!shown.allFinite()) {
        ci.findings.push_back(fmt::format("{} of {} values are missing or not finite",
                                          shown.size() - shown.array().isFinite().count(), shown.size()));
      } else if (time && !complex && shown.size() > 1) {
        judge_channel({signal.name, ci.quantity, shown}, axis, ci);
      }
      ti.channels.push_back(std::move(ci));
    }
    info.tables.push_back(std::move(ti));
  }
  return info;
}

std::string to_string(const RecordingInfo& info) {
  return fmt::format("{}: {} channels, {} samples, {:.9g} Hz, {:.6g} s\n", info.source, info.channels.size(),
                     info.samples, info.rate, info.duration) +
         channel_lines(info.channels);
}

std::string to_string(const FileInfo& info) {
  std::string out = fmt::format("{}: {}\n", info.source, info.format);
  for (const TableInfo& t : info.tables) {
    const std::string title = t.name.empty() ? "" : t.name + ": ";
    if (t.abscissa == "time" && t.step > 0) {
      out += fmt::format("\n{}{} channels, {} samples, {:.9g} Hz, {:.6g} s\n", title, t.channels.size(), t.rows,
                         1 / t.step, t.step * static_cast<double>(t.rows));
    } else if (t.step > 0) {
      out += fmt::format("\n{}{} channels, {} lines from {:g} Hz in steps of {:g} Hz\n", title, t.channels.size(),
                         t.rows, t.start, t.step);
    } else {
      out += fmt::format("\n{}{} channels, {} {}\n", title, t.channels.size(), t.rows,
                         t.abscissa == "rows" ? "rows without an axis" : t.abscissa + " values that are not uniform");
    }
    out += channel_lines(t.channels);
  }
  if (!info.contents.empty()) out += "\nalso:\n";
  for (const std::string& c : info.contents) out += "  " + c + "\n";
  for (const std::string& f : info.findings) out += "  ! " + f + "\n";
  return out;
}

}  // namespace whirl::io
