#include "whirl/monitor/speed_trend.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace whirl::monitor {
namespace {

constexpr double kWindow = 1;       // s
constexpr std::size_t kFewest = 8;  // turns
constexpr double kBegin = 0.02, kEnd = 0.005;
constexpr double kSilence = 2.5;  // turns

}  // namespace

std::string_view name(Trend trend) {
  return trend == Trend::run_up ? "run-up" : trend == Trend::run_down ? "run-down" : "steady";
}

double SpeedTrend::slope() const {
  double mt = 0, mv = 0, tt = 0, tv = 0;
  const double n = static_cast<double>(window_.size());
  for (const Point& p : window_) mt += p.t / n, mv += p.speed / n;
  for (const Point& p : window_) tt += (p.t - mt) * (p.t - mt), tv += (p.t - mt) * (p.speed - mv);
  return tt > 0 ? tv / tt : 0;
}

void SpeedTrend::add(const Point& p) {
  run_.end = p.t;
  run_.speed_end = p.speed;
  run_.largest.resize(p.amplitude.size());
  for (std::size_t k = 0; k < p.amplitude.size(); ++k) {
    if (p.amplitude[k] > run_.largest[k].amplitude) run_.largest[k] = {p.amplitude[k], p.speed};
  }
}

std::optional<SpeedTrend::Run> SpeedTrend::finish() {
  trend_ = Trend::steady;
  window_.clear();
  return std::exchange(run_, {});
}

std::optional<SpeedTrend::Run> SpeedTrend::turn(double t, double speed, const std::vector<double>& amplitude) {
  window_.push_back({t, std::abs(speed), amplitude});
  while (window_.size() > kFewest && t - window_.front().t > kWindow) window_.pop_front();
  if (trend_ != Trend::steady) add(window_.back());
  if (window_.size() < kFewest) return {};
  const double change = slope() * (t - window_.front().t), size = std::abs(speed);
  const bool up = change > 0;
  if (trend_ == Trend::steady && std::abs(change) > kBegin * size) {
    trend_ = up ? Trend::run_up : Trend::run_down;
    run_ = {};
    run_.trend = trend_;
    // It began where the speed left the one before.
    for (const Point& p : window_) {
      if (std::abs(p.speed - window_.front().speed) > kEnd * size) break;
      run_.begin = p.t;
      run_.speed_begin = p.speed;
    }
    for (const Point& p : window_) add(p);
  } else if (trend_ != Trend::steady && (std::abs(change) < kEnd * size || up != (trend_ == Trend::run_up))) {
    // The last second showed that the run was over: it ended where that second begins.
    if (window_.front().t > run_.begin) run_.end = window_.front().t, run_.speed_end = window_.front().speed;
    return finish();
  }
  return {};
}

std::optional<SpeedTrend::Run> SpeedTrend::interrupt() {
  if (trend_ != Trend::steady) return finish();
  window_.clear();
  return {};
}

std::optional<SpeedTrend::Run> SpeedTrend::stopped(double t) {
  if (trend_ == Trend::steady || window_.empty() ||
      t - window_.back().t < std::max(0.5, kSilence * 2 * std::numbers::pi / window_.back().speed))
    return {};
  return finish();
}

}  // namespace whirl::monitor
