#include "whirl/io/info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <unordered_set>
#include <vector>

#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

constexpr const char* kConstant = "constant: the sensor may not be connected";
constexpr const char* kOtherTables =
    "its axes change inside the file: it cannot be read in parts; --rows FIRST:END reads some rows";

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

/// At most `most` different values.
bool few_values(const Eigen::VectorXd& x, std::size_t most) {
  std::unordered_set<double> values;
  for (const double v : x)
    if (values.insert(v).second && values.size() > most) return false;
  return true;
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

void judge_channel(const Eigen::VectorXd& x, const SignalTable& table, ChannelInfo& info) {
  std::vector<std::string>& out = info.findings;
  if (info.minimum == info.maximum) {
    out.push_back(kConstant);
    return;
  }
  const auto at = [&](Eigen::Index i) {
    return fmt::format("{:.6g} s", table.start + (table.step > 0 ? table.step : 1) * static_cast<double>(i));
  };
  const Steps steps = neighbour_steps(x, info.minimum, info.maximum);
  const double range = info.maximum - info.minimum;
  const bool held = static_cast<double>(steps.equal) > 0.2 * static_cast<double>(x.size());
  const double levels = range / steps.smallest;
  // A short period has large steps from sample to sample without being coarse: its values are many.
  const bool coarse = levels < 64 && few_values(x, static_cast<std::size_t>(2 * (levels + 1)));
  if (coarse) out.push_back(fmt::format("coarse: about {:.0f} levels between minimum and maximum", levels + 1));

  for (const auto& [value, name] : {std::pair{info.maximum, "maximum"}, std::pair{info.minimum, "minimum"}}) {
    const Runs at_end = equal_runs(x, 3, [v = value](double s) { return s == v; });
    if (at_end.long_ones >= 3 && !held && !coarse) {
      info.damage.push_back(fmt::format("clipped: the {} {:.6g} {} is held for 3 or more samples {} times", name, value,
                                        si_unit(info.quantity), at_end.long_ones));
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
  const bool oscillates = info.quantity == Quantity::displacement || info.quantity == Quantity::velocity ||
                          info.quantity == Quantity::acceleration || info.quantity == Quantity::force;
  const double alternating = std::sqrt(std::max(0.0, info.rms * info.rms - info.mean * info.mean));
  if (oscillates && std::abs(info.mean) > 3 * alternating) {
    out.push_back(fmt::format("mean {:.4g} {} is {:.1f} times the alternating rms: remove the offset?", info.mean,
                              si_unit(info.quantity), std::abs(info.mean) / alternating));
  }
  if (const auto [count, first] = spikes(x); count > 0 && !held) {
    info.damage.push_back(fmt::format("{} single-sample spikes, the first at {}", count, at(first)));
  }
}

}  // namespace

namespace {

/// Range, mean and rms of the finite values, whatever the parts are that they come in.
class ChannelStatistics {
 public:
  void add(const Eigen::Ref<const Eigen::VectorXd>& samples) {
    for (const double v : samples) {
      if (!std::isfinite(v)) continue;
      minimum_ = finite_ == 0 ? v : std::min(minimum_, v);
      maximum_ = finite_ == 0 ? v : std::max(maximum_, v);
      sum_ += v;
      squares_ += static_cast<long double>(v) * v;
      ++finite_;
    }
    all_ += samples.size();
  }
  Eigen::Index missing() const { return all_ - finite_; }
  ChannelInfo info(const std::string& name) const {
    ChannelInfo out;
    out.name = name;
    if (finite_ == 0) return out;
    out.minimum = minimum_;
    out.maximum = maximum_;
    out.mean = static_cast<double>(sum_ / static_cast<long double>(finite_));
    out.rms = static_cast<double>(std::sqrt(squares_ / static_cast<long double>(finite_)));
    return out;
  }

 private:
  double minimum_ = 0, maximum_ = 0;
  long double sum_ = 0, squares_ = 0;
  Eigen::Index finite_ = 0, all_ = 0;
};

/// Of complex values the magnitude.
Eigen::VectorXd shown_values(const Signal& signal) {
  if (signal.imaginary.size() == 0) return signal.value;
  return (signal.value.cwiseAbs2() + signal.imaginary.cwiseAbs2()).cwiseSqrt();
}

/// What is known of a table of so many rows; `judge` looks at channels over time without missing values.
void add_table(FileInfo& info, const SignalTable& table, Eigen::Index rows,
               const std::vector<ChannelStatistics>& statistics,
               const std::function<void(const Signal&, ChannelInfo&)>& judge) {
  const bool time = table.abscissa == Quantity::time;
  TableInfo ti{table.name,
               time ? "time" : table.abscissa ? "frequency" : "rows",
               table.start,
               table.step,
               static_cast<long>(rows),
               {}};
  if (table.x.size() > 0)
    info.findings.push_back(fmt::format("the {} values of table '{}' are not uniform", ti.abscissa, table.name));
  if (!table.abscissa && rows > 1)
    info.findings.push_back("no column of time: state the sample rate with --rate HZ to read it as a record");
  for (std::size_t c = 0; c < statistics.size(); ++c) {
    const Signal& signal = table.signals[c];
    ChannelInfo ci = statistics[c].info(signal.name);
    ci.quantity = signal.quantity.value_or(Quantity::dimensionless);
    ci.unit = signal.quantity ? std::string(si_unit(*signal.quantity)) : signal.unit;
    if (const Eigen::Index missing = statistics[c].missing(); missing > 0)
      ci.findings.push_back(fmt::format("{} of {} values are missing or not finite", missing, rows));
    else if (time && rows > 1)
      judge(signal, ci);
    ti.channels.push_back(std::move(ci));
  }
  info.tables.push_back(std::move(ti));
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

FileInfo describe(const SignalFile& file) {
  FileInfo info{file.source, file.format, {}, file.contents, file.findings};
  for (const SignalTable& table : file.tables) {
    std::vector<ChannelStatistics> statistics(table.signals.size());
    for (std::size_t c = 0; c < statistics.size(); ++c) statistics[c].add(shown_values(table.signals[c]));
    add_table(info, table, table.rows(), statistics, [&](const Signal& signal, ChannelInfo& ci) {
      if (signal.imaginary.size() == 0) judge_channel(signal.value, table, ci);
    });
  }
  return info;
}

FileInfo describe(SignalStream& stream, const std::function<void(double)>& progress) {
  SignalFile part;
  std::vector<SignalTable> heads;  // of the first part, without values
  std::vector<std::vector<ChannelStatistics>> statistics;
  std::vector<Eigen::Index> rows;
  FileInfo info;
  while (stream.next(part)) {
    if (heads.empty()) {
      info.source = part.source;
      info.format = part.format;
      info.contents = part.contents;
      for (SignalTable& table : part.tables) statistics.emplace_back(table.signals.size());
      rows.resize(part.tables.size());
    }
    if (!heads.empty() && part.tables.size() != heads.size()) throw Error::in_file(info.source, 0, kOtherTables);
    for (std::size_t k = 0; k < part.tables.size(); ++k) {
      SignalTable& table = part.tables[k];
      if (table.signals.size() != statistics[k].size()) throw Error::in_file(info.source, 0, kOtherTables);
      for (std::size_t c = 0; c < table.signals.size(); ++c) statistics[k][c].add(shown_values(table.signals[c]));
      rows[k] += table.rows();
      if (heads.empty() || table.x.size() == 0) continue;
      heads[k].x = table.x.head(1);  // uneven from here on
      heads[k].step = 0;
    }
    info.findings.insert(info.findings.end(), part.findings.begin(), part.findings.end());
    if (heads.empty()) {
      heads = std::move(part.tables);
      for (SignalTable& table : heads)
        for (Signal& signal : table.signals) signal.value = Eigen::VectorXd();
    }
    progress(stream.done());
  }
  for (std::size_t k = 0; k < heads.size(); ++k) {
    add_table(info, heads[k], rows[k], statistics[k], [](const Signal&, ChannelInfo& ci) {
      if (ci.minimum == ci.maximum) ci.findings.push_back(kConstant);
    });
  }
  info.findings.push_back(
      "read in parts: damage and vibration are not looked for; --rows FIRST:END looks at some rows");
  return info;
}

std::string to_string(const FileInfo& info) {
  std::string out = fmt::format("{}: {}\n", info.source, info.format);
  for (const TableInfo& t : info.tables) {
    const std::string title = t.name.empty() ? "" : t.name + ": ", channels = counted(t.channels.size(), "channel");
    if (t.abscissa == "time" && t.step > 0) {
      out += fmt::format("\n{}{}, {}, {:.9g} Hz, {:.6g} s\n", title, channels, counted(t.rows, "sample"), 1 / t.step,
                         t.step * static_cast<double>(t.rows));
    } else if (t.step > 0) {
      out += fmt::format("\n{}{}, {} from {:g} Hz in steps of {:g} Hz\n", title, channels, counted(t.rows, "line"),
                         t.start, t.step);
    } else {
      out += fmt::format("\n{}{}, {} {}\n", title, channels, t.rows,
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
