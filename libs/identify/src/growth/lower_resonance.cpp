#include "growth/lower_resonance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "whirl/core/angles.hpp"

namespace whirl::identification::detail {
namespace {

constexpr std::size_t kBins = 60;   // of equal ratio, from a tenth of the highest speed on
constexpr double kLowest = 0.1;     // of the highest speed
constexpr double kValley = 0.5;     // of the smaller of both peaks; beats behind a resonance are shallower
constexpr double kApart = 1.3;      // ratio of the speeds of both peaks
constexpr double kLeastTurns = 20;  // below the valley, of each record: 10 windows of the weak equations

/// Mean square of the motion about its mean in each bin of speed; negative: no samples.
std::array<double, kBins> power_over_speed(const std::vector<RotorRecord>& records, double top) {
  std::array<double, kBins> square{}, count{};
  std::array<std::complex<double>, kBins> sum{};
  for (const RotorRecord& r : records) {
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      const double at = 1 - std::log(std::abs(r.angle.omega[2 * i]) / top) / std::log(kLowest);
      if (!(at >= 0)) continue;
      const auto bin = std::min(kBins - 1, static_cast<std::size_t>(at * kBins));
      square[bin] += std::norm(r.z[i]), sum[bin] += r.z[i], count[bin] += 1;
    }
  }
  for (std::size_t b = 0; b < kBins; ++b)
    square[b] = count[b] > 0 ? square[b] / count[b] - std::norm(sum[b] / count[b]) : -1;
  return square;
}

double speed_of(std::size_t bin, double top) {
  return top * std::pow(kLowest, 1 - (static_cast<double>(bin) + 0.5) / kBins);
}

/// Speed of the valley behind the lowest peak, rad/s; 0: none.
double valley_of(const std::array<double, kBins>& power, double top) {
  std::size_t peak = 0, valley = 0;
  for (std::size_t b = 0; b < kBins; ++b) {
    if (power[b] < 0) continue;
    const bool deep = power[valley] < kValley * kValley * std::min(power[peak], power[b]);
    if (deep && speed_of(b, top) > kApart * speed_of(peak, top)) return speed_of(valley, top);
    if (power[b] > power[peak]) {
      peak = valley = b;
    } else if (power[b] < power[valley]) {
      valley = b;
    }
  }
  return 0;
}

}  // namespace

std::optional<WeakRotorFit> lower_resonance(const std::vector<RotorRecord>& records, const WeakRotorOptions& weak) {
  double top = 0;
  for (const RotorRecord& r : records) top = std::max(top, r.speed_high());
  const double valley = valley_of(power_over_speed(records, top), top);
  if (!(valley > 0)) return {};
  std::vector<RotorRecord> below = records;
  for (RotorRecord& r : below) {
    if (!r.usable_x.size()) r.usable_x = r.usable_y = Eigen::ArrayXd::Ones(r.size());
    double turns = 0;
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      const double omega = std::abs(r.angle.omega[2 * i]);
      if (omega > valley)
        r.usable_x[i] = r.usable_y[i] = 0;
      else
        turns += omega * r.dt / kTwoPi;
    }
    if (turns < kLeastTurns) return {};
  }
  WeakRotorFit fit = fit_weak_rotor(below, weak);
  if (fit.summary.status == Status::unusable || !(fit.model.c > 0) || !(fit.model.k1 > 0)) return {};
  return fit;
}

}  // namespace whirl::identification::detail
