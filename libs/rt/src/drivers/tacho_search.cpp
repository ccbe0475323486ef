#include "whirl/rt/drivers/tacho_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace whirl::rt {
namespace {

constexpr std::size_t kMoreEdges = 4;     // edges beside a turn of them: two more than a constant acceleration needs
constexpr double kEdgeScatter = 0.29;     // ticks, of an edge without a sample on its way
constexpr double kPatternUneven = 0.015;  // of the distance between marks: what torque moves within one
constexpr double kPatternSteady = 2.5;    // deviations, rms: more is not this pattern
constexpr double kPatternApart = 10;      // deviations between the patterns of two marks that can be told apart

}  // namespace

TachoSearch::TachoSearch(const std::vector<double>& marks, double sample_time)
    : marks_(marks),
      times_(marks.size() + kMoreEdges),
      line_(times_.size()),
      curve_(times_.size()),
      sample_time_(sample_time),
      least_room_(marks.front() + 1 - marks.back()) {
  for (std::size_t i = 1; i < marks.size(); ++i) least_room_ = std::min(least_room_, marks[i] - marks[i - 1]);
}

void TachoSearch::edge(double time) noexcept {
  times_[next_] = time;
  next_ = (next_ + 1) % times_.size();
  known_ = std::min(known_ + 1, times_.size());
}

double TachoSearch::place(std::size_t newest, std::size_t back) const noexcept {
  const std::size_t n = marks_.size(), turns = (back + n - 1 - newest) / n;
  return marks_[newest + turns * n - back] - static_cast<double>(turns);
}

TachoSearch::Found TachoSearch::look() noexcept {
  Found out;
  const std::size_t m = times_.size(), n = marks_.size();
  const double newest = times_[(next_ + m - 1) % m], span = newest - times_[next_];
  if (!(span > 0)) return out;
  // Polynomials of the times that are orthogonal over them: the same for every mark.
  const auto at = [&](std::size_t j) { return (times_[(next_ + j) % m] - newest) / span; };
  double mean = 0, squares = 0, cubes = 0;
  for (std::size_t j = 0; j < m; ++j) mean += at(j) / static_cast<double>(m);
  for (std::size_t j = 0; j < m; ++j) {
    line_[j] = at(j) - mean;
    squares += line_[j] * line_[j];
    cubes += line_[j] * line_[j] * line_[j];
  }
  const double bend = cubes / squares, level = squares / static_cast<double>(m);
  double fourths = 0;
  for (std::size_t j = 0; j < m; ++j) {
    curve_[j] = (line_[j] - bend) * line_[j] - level;
    fourths += curve_[j] * curve_[j];
  }
  if (!(fourths > 0)) return out;
  double best = std::numeric_limits<double>::infinity(), second = best, turned = 0;
  for (std::size_t mark = 0; mark < n; ++mark) {
    double sum = 0, first = 0, bent = 0;
    for (std::size_t j = 0; j < m; ++j) {
      const double p = place(mark, m - 1 - j);
      sum += p, first += p * line_[j], bent += p * curve_[j];
    }
    const double c0 = sum / static_cast<double>(m), c1 = first / squares, c2 = bent / fourths;
    double left = 0;
    for (std::size_t j = 0; j < m; ++j) {
      const double e = place(mark, m - 1 - j) - c0 - c1 * line_[j] - c2 * curve_[j];
      left += e * e;
    }
    second = std::min(second, std::max(left, best));
    if (left >= best) continue;
    best = left;
    out.mark = mark;
    out.speed = (c1 + c2 * (2 * line_[m - 1] - bend)) / span;
    out.acceleration = 2 * c2 / (span * span);
    turned = marks_[mark] - place(mark, m - 1);
  }
  const double deviation = std::max(kEdgeScatter * sample_time_ * turned / span, kPatternUneven * least_room_);
  // A shaft that turned back is none that is found.
  const bool forward = out.speed > 0 && out.speed - out.acceleration * span > 0;
  out.steady = forward && best <= static_cast<double>(m - 3) * kPatternSteady * kPatternSteady * deviation * deviation;
  out.unique = out.steady && second - best >= kPatternApart * kPatternApart * deviation * deviation;
  return out;
}

}  // namespace whirl::rt
