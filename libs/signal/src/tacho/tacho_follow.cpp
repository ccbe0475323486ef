// Grossly uneven marks (magnets glued by hand, both edges of a notch): their number and the pulses mark by mark.
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "tacho_marks.hpp"
#include "whirl/core/error.hpp"

namespace whirl::signal::detail {
namespace {

constexpr int kMostUneven = 12;        // marks a turn
constexpr double kSameInterval = 0.1;  // of the logarithms of an interval and that of the next turn

std::vector<double> log_intervals(const std::vector<double>& times) {
  std::vector<double> out;
  for (std::size_t k = 1; k < times.size(); ++k) out.push_back(std::log(std::max(times[k] - times[k - 1], 1e-12)));
  return out;
}

double interval_quantile(std::vector<double> v, double share) {
  const auto at = v.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(v.size() - 1));
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

/// Where the pulses seen so far say that a later instant is, in turns: a parabola through the last ones (exact at
/// constant acceleration).
class TurnTrend {
 public:
  TurnTrend(const MarkedPulses& p, std::size_t most) {
    const std::size_t n = std::min(most, p.pulses.times.size()), first = p.pulses.times.size() - n;
    at_ = p.pulses.times.back();
    turn_ = p.pulses.turns.back();
    scale_ = at_ - p.pulses.times[first];
    Eigen::MatrixXd powers(static_cast<Eigen::Index>(n), 3);
    Eigen::VectorXd turns(static_cast<Eigen::Index>(n));
    for (std::size_t k = 0; k < n; ++k) {
      const double s = (p.pulses.times[first + k] - at_) / scale_;
      powers.row(static_cast<Eigen::Index>(k)) << 1, s, s * s;
      turns[static_cast<Eigen::Index>(k)] = p.pulses.turns[first + k] - turn_;
    }
    c_ = powers.colPivHouseholderQr().solve(turns);
  }
  double turn(double t) const {
    const double s = (t - at_) / scale_;
    return turn_ + c_[0] + s * (c_[1] + s * c_[2]);
  }
  /// Speed at `t` as a share of that at the last pulse.
  double speed_share(double t) const { return (c_[1] + 2 * c_[2] * (t - at_) / scale_) / c_[1]; }

 private:
  double at_ = 0, turn_ = 0, scale_ = 1;
  Eigen::Vector3d c_;
};

/// Turn of mark `m`, counted on through the turns from mark 0 of turn 0.
double mark_turn(const std::vector<double>& marks, long m) {
  const auto n = static_cast<long>(marks.size());
  const long turn = m >= 0 ? m / n : -((-m + n - 1) / n);
  return static_cast<double>(turn) + marks[static_cast<std::size_t>(m - turn * n)];
}

/// The mark nearest to `turn` of those after mark `after`.
long nearest_mark(const std::vector<double>& marks, double turn, long after) {
  long m = std::max(after + 1, static_cast<long>(std::floor(turn)) * static_cast<long>(marks.size()) - 1);
  while (std::abs(mark_turn(marks, m + 1) - turn) <= std::abs(mark_turn(marks, m) - turn)) ++m;
  return m;
}

/// Goes on with the pulses that follow those in `p`, the last of which is mark `last`.
void follow_on(MarkedPulses& p, long last, const std::vector<double>& following) {
  const std::vector<double>& marks = p.pattern.marks;
  const std::size_t window = marks.size() == 1 ? 16 : std::max<std::size_t>(6, 2 * marks.size());
  const auto n = static_cast<long>(marks.size());
  // Distance from mark m in shares of its gap on that side; 0.5 is the middle between two marks.
  const auto off = [&](long m, double turn) {
    const double here = mark_turn(marks, m), e = turn - here;
    return std::abs(e) / std::abs(mark_turn(marks, e > 0 ? m + 1 : m - 1) - here);
  };
  for (std::size_t k = 0; k < following.size(); ++k) {
    const TurnTrend trend(p, window);
    long m = last + 1;
    if (trend.speed_share(following[k]) > 0.3) {  // slower: a rotor that comes to rest; nothing is missing
      const double turn = trend.turn(following[k]);
      m = nearest_mark(marks, turn, last);
      const bool next_better =
          k + 1 < following.size() && nearest_mark(marks, trend.turn(following[k + 1]), last) == m &&
          std::abs(trend.turn(following[k + 1]) - mark_turn(marks, m)) < std::abs(turn - mark_turn(marks, m));
      if (off(m, turn) > 0.35 || next_better) {
        ++p.pulses.extra;
        continue;
      }
    }
    p.pulses.missing += m - last - 1;
    p.pulses.times.push_back(following[k]);
    p.pulses.turns.push_back(mark_turn(marks, m));
    p.mark.push_back(static_cast<std::size_t>(((m % n) + n) % n));
    last = m;
  }
}

/// Time, turns and the order of the marks running backwards; mark 0 stays at a whole turn.
void reverse_marks(MarkedPulses& p) {
  const std::size_t n = p.pattern.marks.size();
  std::vector<double> marks{0};
  for (std::size_t j = n - 1; j > 0; --j) marks.push_back(1 - p.pattern.marks[j]);
  p.pattern.marks = marks;
  std::reverse(p.pulses.times.begin(), p.pulses.times.end());
  std::reverse(p.pulses.turns.begin(), p.pulses.turns.end());
  std::reverse(p.mark.begin(), p.mark.end());
  for (double& t : p.pulses.times) t = -t;
  for (double& u : p.pulses.turns) u = -u;
  for (std::size_t& m : p.mark) m = (n - m) % n;
}

long last_mark(const MarkedPulses& p) {
  const auto n = static_cast<double>(p.pattern.marks.size());
  return std::lround((p.pulses.turns.back() - p.pattern.marks[p.mark.back()]) * n) + static_cast<long>(p.mark.back());
}

/// Shares of a turn of the gaps that begin at each mark, from pulses without damage.
std::vector<double> gap_shares(const std::vector<double>& t, std::size_t first, std::size_t last, std::size_t n) {
  std::vector<double> sum(n, 0);
  std::vector<int> count(n, 0);
  const std::size_t before = n / 2;
  for (std::size_t k = first + before; k + n - before + 1 <= last; ++k) {
    // Duration of the turn about the gap from pulse k to k + 1: its middle is the middle of the gap for odd n; for even
    // n the mean of the two that are half a gap off.
    const double a = t[k - before + n] - t[k - before];
    const double b = n % 2 == 1 ? a : t[k - before + n + 1] - t[k - before + 1];
    sum[(k - first) % n] += (t[k + 1] - t[k]) / (0.5 * (a + b));
    ++count[(k - first) % n];
  }
  double total = 0;
  for (std::size_t j = 0; j < n; ++j) total += sum[j] /= std::max(count[j], 1);
  for (double& s : sum) s /= total;
  return sum;
}

}  // namespace

int uneven_marks(const std::vector<double>& times, double quantum) {
  constexpr double kUneven = 0.04;  // of the logarithms of neighbouring intervals
  const std::vector<double> l = log_intervals(times);
  const double rounding = quantum / std::exp(interval_quantile(l, 0.5));
  std::vector<double> size;
  for (std::size_t n = 1; n <= kMostUneven && l.size() >= 4 * n + 2; ++n) {
    std::vector<double> second;
    for (std::size_t k = n; k + n < l.size(); ++k) second.push_back(std::abs(l[k + n] - 2 * l[k] + l[k - n]));
    size.push_back(interval_quantile(std::move(second), 0.4));
  }
  if (size.size() < 2 || size.front() < std::max(kUneven, 6 * rounding)) return 0;
  const double smallest = *std::min_element(size.begin(), size.end());
  if (smallest > 0.12 * size.front()) return 0;
  for (std::size_t n = 1; n <= size.size(); ++n)
    if (size[n - 1] <= std::max(2 * smallest, 2 * rounding)) return static_cast<int>(n);
  return 0;
}

std::pair<std::size_t, std::size_t> alike_turns(const std::vector<double>& times, int marks) {
  const auto n = static_cast<std::size_t>(marks);
  const std::vector<double> l = log_intervals(times);
  std::size_t first = 0, best_first = 0, best_last = 0;
  for (std::size_t k = 0; k + n < l.size(); ++k) {
    if (std::abs(l[k + n] - l[k]) > kSameInterval) {
      first = k + 1;
      continue;
    }
    if (k + n + 1 - first > best_last - best_first) best_first = first, best_last = k + n + 1;
  }
  return {best_first, best_last};
}

MarkedPulses follow_marks(const std::vector<double>& times, int marks) {
  const auto n = static_cast<std::size_t>(marks);
  const auto [best_first, best_last] = alike_turns(times, marks);
  if (best_last - best_first < 2 * n + 1) throw Error("pulses: no two turns in a row have the same pattern of marks");
  MarkedPulses p;
  p.pattern.places = marks;
  // The first mark of a turn is the one after the longest gap.
  const std::vector<double> gaps = gap_shares(times, best_first, best_last, n);
  const std::size_t zero =
      (static_cast<std::size_t>(std::max_element(gaps.begin(), gaps.end()) - gaps.begin()) + 1) % n;
  p.pattern.marks.assign(1, 0);
  for (std::size_t j = 0; j + 1 < n; ++j) p.pattern.marks.push_back(p.pattern.marks.back() + gaps[(zero + j) % n]);
  for (std::size_t k = best_first; k <= best_last; ++k) {
    const std::size_t j = k - best_first + n - zero;
    p.pulses.times.push_back(times[k]);
    p.pulses.turns.push_back(mark_turn(p.pattern.marks, static_cast<long>(j)));
    p.mark.push_back(j % n);
  }
  follow_on(p, last_mark(p), {times.begin() + static_cast<std::ptrdiff_t>(best_last) + 1, times.end()});
  std::vector<double> before(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(best_first));
  std::reverse(before.begin(), before.end());
  for (double& t : before) t = -t;
  reverse_marks(p);
  follow_on(p, last_mark(p), before);
  reverse_marks(p);
  return p;
}

}  // namespace whirl::signal::detail
