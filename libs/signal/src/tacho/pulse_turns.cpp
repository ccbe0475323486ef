#include "pulse_turns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "whirl/core/error.hpp"

namespace whirl::signal::detail {
namespace {

constexpr double kEven = 0.8;         // neighbouring periods of one stretch differ by no more than this factor
constexpr std::size_t kShortest = 4;  // periods of a stretch to start from

/// Squared speeds of the last turns; linear in the turn at constant acceleration.
class SpeedTrend {
 public:
  void add(double turn, double period, double count) {
    turns_.push_back(turn + 0.5 * count);
    squares_.push_back(count * count / (period * period));
    if (turns_.size() <= kMost) return;
    turns_.pop_front();
    squares_.pop_front();
  }
  double last() const { return squares_.back(); }
  /// Squared speed half a turn after `turn`, by the line through the last ones.
  double next(double turn) const {
    const double n = static_cast<double>(turns_.size());
    double mean_t = 0, mean_s = 0, tt = 0, ts = 0;
    for (std::size_t i = 0; i < turns_.size(); ++i) {
      mean_t += turns_[i] / n;
      mean_s += squares_[i] / n;
    }
    for (std::size_t i = 0; i < turns_.size(); ++i) {
      tt += (turns_[i] - mean_t) * (turns_[i] - mean_t);
      ts += (turns_[i] - mean_t) * (squares_[i] - mean_s);
    }
    return tt > 0 ? mean_s + ts / tt * (turn + 0.5 - mean_t) : mean_s;
  }

 private:
  static constexpr std::size_t kMost = 6;
  std::deque<double> turns_, squares_;
};

/// First and last pulse of the longest stretch of even ones.
std::pair<std::size_t, std::size_t> longest_even(const std::vector<double>& times) {
  std::pair<std::size_t, std::size_t> best{0, 0};
  std::size_t first = 0;
  for (std::size_t k = 1; k < times.size(); ++k) {
    if (k >= first + 2) {
      const double ratio = (times[k] - times[k - 1]) / (times[k - 1] - times[k - 2]);
      if (!(ratio > kEven && ratio < 1 / kEven)) first = k - 1;
    }
    if (k - first > best.second - best.first) best = {first, k};
  }
  return best;
}

/// Goes on from counted pulses with those that follow them.
void go_on(CountedPulses& p, const std::vector<double>& following) {
  SpeedTrend trend;
  for (std::size_t k = 1; k < p.times.size(); ++k) {
    const double count = p.turns[k] - p.turns[k - 1];
    trend.add(p.turns[k - 1], p.times[k] - p.times[k - 1], count);
  }
  for (std::size_t k = 0; k < following.size(); ++k) {
    const double last = trend.last(), next = trend.next(p.turns.back());
    const double predicted = 1 / std::sqrt(std::max(next, 0.25 * last));
    const double shortest = 0.7 * std::min(predicted, 1 / std::sqrt(last));
    // A rotor that comes to rest takes long turns: none is missing.
    const bool may_miss = next > 0.5 * last;
    const auto turns_to = [&](std::size_t i) { return (following[i] - p.times.back()) / predicted; };
    if (following[k] - p.times.back() < shortest) {
      ++p.extra;
      continue;
    }
    if (may_miss && k + 1 < following.size() && turns_to(k + 1) < 1.5 &&
        std::abs(turns_to(k + 1) - 1) < std::abs(turns_to(k) - 1)) {
      ++p.extra;
      continue;
    }
    const double count = may_miss ? std::max(1.0, std::round(turns_to(k))) : 1.0;
    p.missing += static_cast<long>(count) - 1;
    trend.add(p.turns.back(), following[k] - p.times.back(), count);
    p.turns.push_back(p.turns.back() + count);
    p.times.push_back(following[k]);
  }
}

/// The same pulses with time and turns running backwards.
void reverse(CountedPulses& p) {
  const double turns = p.turns.back();
  std::reverse(p.times.begin(), p.times.end());
  std::reverse(p.turns.begin(), p.turns.end());
  for (double& t : p.times) t = -t;
  for (double& n : p.turns) n = turns - n;
}

}  // namespace

CountedPulses count_turns(const std::vector<double>& times) {
  const auto [first, last] = longest_even(times);
  if (last - first < kShortest) {
    throw Error(fmt::format("once-per-turn pulses: no {} of {} periods in a row are even: not pulses of a rotor",
                            kShortest, times.size() - 1));
  }
  CountedPulses p;
  for (std::size_t k = first; k <= last; ++k) {
    p.times.push_back(times[k]);
    p.turns.push_back(static_cast<double>(k - first));
  }
  go_on(p, {times.begin() + static_cast<std::ptrdiff_t>(last) + 1, times.end()});
  std::vector<double> before(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(first));
  std::reverse(before.begin(), before.end());
  for (double& t : before) t = -t;
  reverse(p);
  go_on(p, before);
  reverse(p);
  return p;
}

}  // namespace whirl::signal::detail
