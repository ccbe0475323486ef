#include "record/start_motion.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

namespace whirl::identification::detail {
namespace {

using Complex = std::complex<double>;

constexpr double kLeak = 0.25;         // of a leaky integrator, as a share of the speed: noise below it is not summed
constexpr double kLeastTurning = 0.1;  // of the top speed: the corner falls no further

template <class Array>
void cut_array(Array& all, Eigen::Index first, Eigen::Index count) {
  if (all.size() > 0) all = Array(all.segment(first, count));
}

/// Rate of the leak at every sample, 1/s.
struct Leak {
  explicit Leak(const RotorRecord& r) : record(&r), slow(kLeastTurning * r.speed_high()) {}
  double operator()(Eigen::Index sample) const {
    return kLeak * std::max(std::abs(record->angle.omega[2 * sample]), slow);
  }
  const RotorRecord* record;
  double slow;  ///< rad/s: below it nothing turns
};

/// One leaky integration over trapezoids, divided by what it makes of a line at the speed over what an integral makes.
Eigen::VectorXcd leaky_integral(const RotorRecord& r, const Leak& leak, const Eigen::VectorXcd& rate) {
  Eigen::VectorXcd out(rate.size());
  Complex sum = 0;
  for (Eigen::Index i = 0; i < rate.size(); ++i) {
    const double keep = std::exp(-leak(i) * r.dt), w = r.angle.omega[2 * i];
    const Complex turn = std::polar(1.0, w * r.dt), gain = 0.5 * r.dt * (turn + keep) / (turn - keep);
    if (i == 0) {
      sum = gain * rate[0];
    } else {
      sum = keep * sum + 0.5 * r.dt * (keep * rate[i - 1] + rate[i]);
    }
    // Near standstill nothing turns: the leak alone.
    out[i] = std::abs(w) > leak.slow ? sum / (gain * Complex(0, w)) : sum;
  }
  return out;
}

/// Standard deviation of the integral of white noise with a leak.
double integral_noise(const RotorRecord& r, double w) {
  const double white = std::sqrt(r.noise_variance() * r.dt);
  return r.derivative() == 1 ? white / std::sqrt(2 * w) : white / (2 * std::pow(w, 1.5));
}

/// The samples between the first and the last that turn at least so fast.
std::pair<Eigen::Index, Eigen::Index> turning_span(const RotorRecord& r, double speed) {
  Eigen::Index first = 0, end = r.size();
  const auto slower = [&](Eigen::Index i) { return std::abs(r.angle.omega[2 * i]) < speed; };
  while (first < end && slower(first)) ++first;
  while (end > first && slower(end - 1)) --end;
  return {first, end - first};
}

}  // namespace

RotorRecord segment_of(const RotorRecord& record, Eigen::Index first, Eigen::Index count) {
  RotorRecord part = record;
  part.t0 += record.dt * static_cast<double>(first);
  for (Eigen::VectorXd* angle : {&part.angle.beta, &part.angle.omega, &part.angle.alpha})
    cut_array(*angle, 2 * first, 2 * count - 1);
  cut_array(part.z, first, count);
  cut_array(part.usable_x, first, count);
  cut_array(part.usable_y, first, count);
  for (std::optional<Clipped>* clipped : {&part.clipped_x, &part.clipped_y}) {
    if (!*clipped) continue;
    cut_array((*clipped)->readings, first, count);
    cut_array((*clipped)->sound, first, count);
  }
  return part;
}

RotorRecord as_displacement(const RotorRecord& record) {
  constexpr double kClear = 5;     // times the noise of the integral: motion
  constexpr double kReach = 0.35;  // of the speed of the largest motion: below it a main mode hardly answers
  constexpr Eigen::Index kLeast = 1000;
  RotorRecord r = record;
  r.z.array() -= r.z.mean();
  const Leak leak(record);
  for (int k = 0; k < record.derivative(); ++k) r.z = leaky_integral(record, leak, r.z);
  Eigen::Index peak = 0;
  double largest = 0;
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const double size = std::abs(r.z[i]);
    if (size <= largest || size < kClear * integral_noise(record, leak(i))) continue;
    largest = size;
    peak = i;
  }
  const auto [first, count] = turning_span(record, kReach * std::abs(record.angle.omega[2 * peak]));
  r.clipped_x.reset();
  r.clipped_y.reset();
  r.hum.clear();
  r.drift = false;
  r.quantity = Quantity::displacement;
  // Innovations summed once or twice with the leak at the lowest speed that is kept.
  const double keep = std::exp(-leak(first) * r.dt);
  r.colour = Eigen::VectorXd::Constant(1, keep);
  if (record.derivative() == 2) r.colour = Eigen::Vector2d(2 * keep, -keep * keep);
  const double size = std::pow(r.dt, record.derivative()) * std::sqrt(r.noise_power() / record.noise_power());
  r.noise_x *= size;
  r.noise_y *= size;
  return count < kLeast ? r : segment_of(r, first, count);
}

}  // namespace whirl::identification::detail
