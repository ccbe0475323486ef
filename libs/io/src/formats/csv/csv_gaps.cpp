#include "formats/csv/csv_gaps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/signal/angle.hpp"
#include "whirl/signal/even_grid.hpp"

namespace whirl::io::detail {
namespace {

constexpr Eigen::Index kShort = 2;  // missing instants that are bridged where times are uneven

struct Grid {
  double start = 0, step = 0;
  std::vector<Eigen::Index> index;  ///< of every sample, rounded
  double worst = 0;                 ///< largest distance from the grid, s
};

/// The median step; throws unless at least a tenth of a grid with that step holds samples.
double median_step(const CsvStream& stream, const Eigen::VectorXd& t) {
  constexpr double kLeastShare = 0.1;
  const Eigen::Index n = t.size();
  Eigen::VectorXd steps = t.tail(n - 1) - t.head(n - 1);
  Eigen::Index longest = 0;
  steps.maxCoeff(&longest);
  const double before = t[longest], after = t[longest + 1];
  std::nth_element(steps.data(), steps.data() + (n - 1) / 2, steps.data() + n - 1);
  const double step = steps[(n - 1) / 2], rows = (t[n - 1] - t[0]) / step + 1;
  if (kLeastShare * rows > static_cast<double>(n)) {
    throw Error::in_file(
        stream.source(), stream.line_of(longest + 1),
        fmt::format("time jumps from {:.9g} s to {:.9g} s, where most steps are {:.6g} s: {} samples would fill a grid "
                    "of {:.4g}, at least a tenth is needed; a wrong time stamp, or two records in one file? "
                    "Correct it, or split the file there",
                    before, after, step, n, rows));
  }
  return step;
}

/// The grid with the median step that fits the times best.
Grid grid_of(const CsvStream& stream, const Eigen::VectorXd& t) {
  const Eigen::Index n = t.size();
  Grid g;
  g.step = median_step(stream, t);
  g.index.assign(static_cast<std::size_t>(n), 0);
  for (Eigen::Index i = 1; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    g.index[k] = g.index[k - 1] + std::max<Eigen::Index>(1, std::lround((t[i] - t[i - 1]) / g.step));
  }
  double sk = 0, st = 0, skk = 0, skt = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double k = static_cast<double>(g.index[static_cast<std::size_t>(i)]), v = t[i] - t[0];
    sk += k;
    st += v;
    skk += k * k;
    skt += k * v;
  }
  const double m = static_cast<double>(n);
  g.step = (m * skt - sk * st) / (m * skk - sk * sk);
  g.start = t[0] + (st - g.step * sk) / m;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double on = g.start + g.step * static_cast<double>(g.index[static_cast<std::size_t>(i)]);
    g.worst = std::max(g.worst, std::abs(t[i] - on));
  }
  return g;
}

/// From which length on a step of uneven times is a hole: more than kShort samples are missing, and it is far beyond
/// what the quartiles of the steps tell of their spread. Lost lines, up to a quarter of the steps, do not move these.
double shortest_hole(const Eigen::VectorXd& t, double about) {
  constexpr double kSpreads = 6.5, kMost = 5;  // of times drawn at random one step in 400 is a hole
  Eigen::VectorXd steps = t.tail(t.size() - 1) - t.head(t.size() - 1);
  std::sort(steps.data(), steps.data() + steps.size());
  const double middle = steps[(steps.size() - 1) / 2], upper = steps[3 * (steps.size() - 1) / 4];
  return std::max((kShort + 1.5) * about, std::min(upper + kSpreads * (upper - middle), kMost * upper));
}

/// A step of the size of those that are no holes; `about` where all are.
double usual_step(const Eigen::VectorXd& t, double hole, double about) {
  Eigen::VectorXd closed(t.size());  // the times with the holes closed
  double sum = 0, steps = 0;
  closed[0] = 0;
  for (Eigen::Index i = 1; i < t.size(); ++i) {
    const double step = t[i] - t[i - 1];
    if (step < hole) {
      sum += step;
      ++steps;
    }
    closed[i] = closed[i - 1] + (step < hole ? step : about);
  }
  return signal::even_step(closed, steps > 0 ? sum / steps : about);
}

/// A channel of uneven times on the grid from t[0], but not inside holes.
Eigen::VectorXd on_grid(const Eigen::VectorXd& t, const Channel& channel, double step, double hole, Eigen::Index rows) {
  const bool angle = channel.quantity == Quantity::angle;
  const Eigen::VectorXd& x = channel.samples;
  Eigen::VectorXd even = Eigen::VectorXd::Constant(rows, kNaN);
  for (Eigen::Index first = 0; first < t.size();) {
    Eigen::Index last = first;
    while (last + 1 < t.size() && std::isfinite(x[last + 1]) == std::isfinite(x[first]) && t[last + 1] - t[last] < hole)
      ++last;
    const Eigen::Index n = last - first + 1;
    if (std::isfinite(x[first]) && n > 1) {
      const auto begin = static_cast<Eigen::Index>(std::ceil((t[first] - t[0]) / step - 1e-9));
      const auto end = static_cast<Eigen::Index>(std::floor((t[last] - t[0]) / step + 1e-9));
      const Eigen::Index inside = std::min(end, rows - 1) - begin + 1;
      // No curve leads through the wraps of an angle.
      const Eigen::VectorXd piece = angle ? signal::unwrapped(x.segment(first, n)) : x.segment(first, n);
      if (inside > 0) {
        even.segment(begin, inside) =
            signal::onto_even_grid(t.segment(first, n), piece, t[0] + step * static_cast<double>(begin), step, inside);
      }
    }
    first = last + 1;
  }
  return even;
}

}  // namespace

std::string take_to_even_grid(const CsvStream& stream, const Eigen::VectorXd& t, double allowed_share, double rounding,
                              Recording& record) {
  const Eigen::Index n = t.size();
  const Grid g = grid_of(stream, t);
  if (g.worst > allowed_share * g.step + rounding) {
    const double hole = shortest_hole(t, g.step), step = usual_step(t, hole, g.step);
    const auto rows = static_cast<Eigen::Index>(std::floor((t[n - 1] - t[0]) / step * (1 + 1e-12))) + 1;
    for (Channel& c : record.channels) c.samples = on_grid(t, c, step, hole, rows);
    record.t0 = t[0];
    record.dt = step;
    return fmt::format(
        "time is not uniform: every sample is moved along the motion to the instant next to it of an even grid, "
        "{:.6g} Hz",
        1 / step);
  } else {
    const Eigen::Index rows = g.index.back() + 1;
    // Many short holes: what is left between them tells neither noise nor structure.
    constexpr Eigen::Index kShortHole = 10;
    constexpr double kMostScattered = 0.15;
    Eigen::Index scattered = 0, first = 0;  // the row behind the first hole
    for (std::size_t i = 1; i < g.index.size(); ++i) {
      const Eigen::Index hole = g.index[i] - g.index[i - 1] - 1;
      if (hole <= 0 || hole > kShortHole) continue;
      if (scattered == 0) first = static_cast<Eigen::Index>(i);
      scattered += hole;
    }
    if (static_cast<double>(scattered) > kMostScattered * static_cast<double>(rows)) {
      throw Error::in_file(
          record.source, stream.line_of(first),
          fmt::format("time is not uniform: of a grid of {:.6g} s {} of {} samples are missing in short holes; the "
                      "first is here. Does the sample rate change? Split the file there",
                      g.step, scattered, rows));
    }
    for (Channel& c : record.channels) {
      Eigen::VectorXd even = Eigen::VectorXd::Constant(rows, kNaN);
      for (Eigen::Index i = 0; i < n; ++i) even[g.index[static_cast<std::size_t>(i)]] = c.samples[i];
      c.samples = std::move(even);
    }
    record.t0 = g.start;
    record.dt = g.step;
    return counted(rows - n, "sample") + (rows - n == 1 ? " is" : " are") + " missing between the times";
  }
}

}  // namespace whirl::io::detail
