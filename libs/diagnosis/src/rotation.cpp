#include "whirl/diagnosis/rotation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/angle.hpp"
#include "whirl/signal/order.hpp"
#include "whirl/signal/tacho.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kStandstill = 0.02;  // of the highest speed

// Speed from differences over about a hundredth of the record, coarse enough for an encoder's steps.
VectorXd coarse_speed(const VectorXd& angle, double dt) {
  const Index n = angle.size(), half = std::max<Index>(1, n / 200);
  VectorXd speed(n);
  for (Index i = 0; i < n; ++i) {
    const Index a = std::max<Index>(0, i - half), b = std::min(n - 1, i + half);
    speed[i] = (angle[b] - angle[a]) / (static_cast<double>(b - a) * dt);
  }
  return speed;
}

bool rises(const VectorXd& angle) {
  for (Index i = 1; i < angle.size(); ++i) {
    if (!(angle[i] > angle[i - 1])) return false;
  }
  return true;
}

// Every other entry of a signal on the grid of half the sample time.
VectorXd at_samples(const VectorXd& half_grid) {
  return half_grid(Eigen::seq(Index{0}, half_grid.size() - 1, Index{2}));
}

std::optional<Rotation> from_encoder(const Recording& record, const VectorXd& readings) {
  const VectorXd raw = signal::unwrapped(readings);
  const VectorXd speed = coarse_speed(raw, record.dt);
  if (std::abs(raw[raw.size() - 1] - raw[0]) < 2 * kTwoPi) return std::nullopt;
  if (raw[raw.size() - 1] < raw[0]) {
    throw Error(fmt::format("{}: beta falls: the rotor angle must rise in the direction of rotation", record.source));
  }
  const double limit = kStandstill * speed.maxCoeff();
  Index first = 0, last = raw.size() - 1;
  while (first < last && speed[first] < limit) ++first;
  while (last > first && speed[last] < limit) --last;
  if (last - first < 16) return std::nullopt;
  Rotation out;
  out.first = first;
  const VectorXd part = raw.segment(first, last - first + 1);
  const signal::AngleFit fit = signal::angle_from_encoder(part, record.dt);
  out.resolution = fit.resolution;
  const VectorXd smooth = at_samples(fit.angle.beta);
  // A speed that no spline follows (a step of the drive) keeps its readings.
  if (rises(part) && fit.residual > std::max(fit.resolution, 5e-3)) {
    out.angle = part;
    out.speed = coarse_speed(part, record.dt);
  } else if (rises(smooth)) {
    out.angle = smooth;
    out.speed = at_samples(fit.angle.omega);
  } else {
    throw Error(fmt::format(
        "{}: beta turns back between {:g} and {:g} s: choose a part in which the shaft turns forward", record.source,
        record.t0 + record.dt * static_cast<double>(first), record.t0 + record.dt * static_cast<double>(last)));
  }
  return out;
}

}  // namespace

double Rotation::sweep_rate(double dt) const {
  const Index n = speed.size(), span = std::max<Index>(1, n / 20);
  double rate = 0;
  for (Index i = 0; i + span < n; i += span) {
    rate = std::max(rate, std::abs(speed[i + span] - speed[i]) / (static_cast<double>(span) * dt));
  }
  return rate;
}

std::optional<Rotation> rotation_of(const Recording& record) {
  if (const Channel* beta = record.find("beta")) {
    if (beta->quantity != Quantity::angle)
      throw Error(fmt::format("{}: beta is a {}, must be an angle", record.source, to_string(beta->quantity)));
    return from_encoder(record, beta->samples);
  }
  if (signal::pulse_channel(record) == nullptr && signal::speed_channel(record) == nullptr) return std::nullopt;
  std::vector<std::string> said;
  const signal::AngleFit fit = signal::angle_of_tacho(record, "", {}, said);
  Rotation out;
  out.angle = at_samples(fit.angle.beta);
  out.speed = at_samples(fit.angle.omega);
  if (!rises(out.angle)) return std::nullopt;
  return out;
}

VectorXd gaps_bridged(VectorXd x) {
  Index known = -1;
  for (Index i = 0; i <= x.size(); ++i) {
    if (i < x.size() && !std::isfinite(x[i])) continue;
    const double left = known >= 0 ? x[known] : i < x.size() ? x[i] : 0, right = i < x.size() ? x[i] : left;
    for (Index k = known + 1; k < i; ++k)
      x[k] = left + (right - left) * static_cast<double>(k - known) / static_cast<double>(i - known);
    known = i;
  }
  return x;
}

namespace {

/// Only the blocks of turns whose readings are all there.
void keep_whole(signal::OrderVectors& v, const VectorXd& x, double dt, int turns) {
  std::vector<Index> kept;
  for (Index b = 0; b < v.value.size(); ++b) {
    const double half = 0.5 * turns * kTwoPi / v.speed[b];
    const auto first = std::max<Index>(0, static_cast<Index>(std::floor((v.time[b] - half) / dt)));
    const auto end = std::min(x.size(), static_cast<Index>(std::ceil((v.time[b] + half) / dt)) + 1);
    if (x.segment(first, end - first).allFinite()) kept.push_back(b);
  }
  v.time = VectorXd(v.time(kept));
  v.speed = VectorXd(v.speed(kept));
  v.value = Eigen::VectorXcd(v.value(kept));
}

}  // namespace

signal::SynchronousCurve order_curve(const Recording& record, const Rotation& rotation, const std::string& channel,
                                     double order, int turns, double slow_roll) {
  const VectorXd x = record[channel].segment(rotation.first, rotation.size());
  signal::OrderVectors v = signal::order_vectors(gaps_bridged(x), rotation.angle, record.dt, order, turns);
  if (x.hasNaN()) keep_whole(v, x, record.dt, turns);
  if (v.value.size() == 0)
    throw Error(fmt::format("{}: channel {}: no turn has all of its readings", record.source, channel));
  signal::SynchronousCurve curve{channel, v.speed, v.value, v.time, record.at(channel).quantity, order};
  if (slow_roll <= 0) return curve;
  std::complex<double> sum = 0;
  long count = 0;
  for (Index i = 0; i < v.speed.size(); ++i) {
    if (v.speed[i] < slow_roll) sum += v.value[i], ++count;
  }
  if (count == 0) {
    throw Error(
        fmt::format("{}: no revolution is slower than the slow-roll speed of {:g} rpm; the slowest has {:.0f} rpm",
                    record.source, slow_roll * 60 / kTwoPi, v.speed.minCoeff() * 60 / kTwoPi));
  }
  curve.vector.array() -= sum / static_cast<double>(count);
  return curve;
}

}  // namespace whirl::diagnosis
