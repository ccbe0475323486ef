#include "formats/csv_gaps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/core/error.hpp"

namespace whirl::io::detail {
namespace {

constexpr Eigen::Index kShort = 2;  // missing instants that the spline bridges where times are uneven
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Natural cubic spline through points with increasing abscissas.
class Spline {
 public:
  Spline(const Eigen::VectorXd& t, const Eigen::VectorXd& x) : t_(t), x_(x), second_(Eigen::VectorXd::Zero(t.size())) {
    const Eigen::Index n = t.size();
    if (n < 3) return;
    // Thomas algorithm on the second derivatives of the inner points.
    Eigen::VectorXd upper(n), right(n);
    upper[0] = right[0] = 0;
    for (Eigen::Index i = 1; i + 1 < n; ++i) {
      const double before = t[i] - t[i - 1], after = t[i + 1] - t[i];
      const double pivot = 2 * (before + after) - before * upper[i - 1];
      upper[i] = after / pivot;
      right[i] = (6 * ((x[i + 1] - x[i]) / after - (x[i] - x[i - 1]) / before) - before * right[i - 1]) / pivot;
    }
    for (Eigen::Index i = n - 2; i > 0; --i) second_[i] = right[i] - upper[i] * second_[i + 1];
  }
  double at(double time) const {
    const Eigen::Index n = t_.size();
    if (n < 2) return n == 1 ? x_[0] : kNaN;
    const double* next = std::upper_bound(t_.data(), t_.data() + n, time);
    const Eigen::Index i = std::clamp<Eigen::Index>(next - t_.data() - 1, 0, n - 2);
    const double h = t_[i + 1] - t_[i], b = (time - t_[i]) / h, a = 1 - b;
    return a * x_[i] + b * x_[i + 1] + h * h / 6 * ((a * a * a - a) * second_[i] + (b * b * b - b) * second_[i + 1]);
  }

 private:
  Eigen::VectorXd t_, x_, second_;
};

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
        fmt::format("time jumps from {:.9g} s to {:.9g} s, where most steps are {:.6g} s: {} samples would stand on a "
                    "grid of {:.4g}, at least a tenth is needed; a wrong time stamp, or two records in one file? "
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

}  // namespace

std::string take_to_even_grid(const CsvStream& stream, const Eigen::VectorXd& t, double allowed_share, double rounding,
                              Recording& record) {
  const Eigen::Index n = t.size();
  const Grid g = grid_of(stream, t);
  if (g.worst > allowed_share * g.step + rounding) {
    // Uneven instants: every channel is read off its spline, but not inside holes.
    const Eigen::Index rows = static_cast<Eigen::Index>(std::floor((t[n - 1] - t[0]) / g.step * (1 + 1e-12))) + 1;
    std::vector<Eigen::VectorXd> even(record.channels.size(), Eigen::VectorXd::Constant(rows, kNaN));
    for (std::size_t c = 0; c < even.size(); ++c) {
      const Eigen::VectorXd& x = record.channels[c].samples;
      for (Eigen::Index first = 0; first < n;) {
        Eigen::Index last = first;
        while (last + 1 < n && std::isfinite(x[last + 1]) == std::isfinite(x[first]) &&
               t[last + 1] - t[last] < (kShort + 1.5) * g.step)
          ++last;
        if (std::isfinite(x[first]) && last > first) {
          const Spline spline(t.segment(first, last - first + 1), x.segment(first, last - first + 1));
          const auto begin = static_cast<Eigen::Index>(std::ceil((t[first] - t[0]) / g.step - 1e-9));
          const auto end = static_cast<Eigen::Index>(std::floor((t[last] - t[0]) / g.step + 1e-9));
          for (Eigen::Index k = begin; k <= std::min(end, rows - 1); ++k)
            even[c][k] = spline.at(t[0] + g.step * static_cast<double>(k));
        }
        first = last + 1;
      }
      record.channels[c].samples = even[c];
    }
    record.t0 = t[0];
    record.dt = g.step;
    return fmt::format(
        "time is not uniform: every channel is read off the spline through its samples, {:.6g} Hz; the noise between "
        "samples is smaller than at them",
        1 / g.step);
  } else {
    const Eigen::Index rows = g.index.back() + 1;
    // Many short holes: what is left between them tells neither noise nor structure.
    constexpr Eigen::Index kShortHole = 10;
    constexpr double kMostScattered = 0.15;
    Eigen::Index scattered = 0;
    for (std::size_t i = 1; i < g.index.size(); ++i) {
      const Eigen::Index hole = g.index[i] - g.index[i - 1] - 1;
      if (hole <= kShortHole) scattered += hole;
    }
    if (static_cast<double>(scattered) > kMostScattered * static_cast<double>(rows)) {
      throw Error(
          fmt::format("{}: time is not uniform: of a grid of {:.6g} s {} of {} samples are missing in short holes; "
                      "does the sample rate "
                      "change? Split the file there",
                      record.source, g.step, scattered, rows));
    }
    for (Channel& c : record.channels) {
      Eigen::VectorXd even = Eigen::VectorXd::Constant(rows, kNaN);
      for (Eigen::Index i = 0; i < n; ++i) even[g.index[static_cast<std::size_t>(i)]] = c.samples[i];
      c.samples = std::move(even);
    }
    record.t0 = g.start;
    record.dt = g.step;
    return fmt::format("{} samples are missing between the times", rows - n);
  }
}

}  // namespace whirl::io::detail
