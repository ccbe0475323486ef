#include "whirl/diagnosis/vibration.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kOneSpeed = 0.03;   // of the mean speed: a drive's slip between no load and full load is below it
constexpr double kLongestBlock = 4;  // s, of the spectrum whose largest line is named

/// Mean, largest distance from it and rms about it of the finite samples. False: none is finite.
bool describe(const VectorXd& x, ChannelVibration& out) {
  const auto finite = x.array().isFinite();
  const auto count = static_cast<double>(finite.count());
  if (count == 0) return false;
  out.mean = finite.select(x, 0.0).sum() / count;
  const VectorXd motion = finite.select(x.array() - out.mean, 0.0);
  out.largest = motion.cwiseAbs().maxCoeff();
  out.rms = std::sqrt(motion.squaredNorm() / count);
  return true;
}

/// Frequency of the tone near line `near`: the lines of a Hann window beside the largest one tell where between them it
/// lies (Grandke 1983). A flat top's lines are alike by design and tell nothing.
double tone_frequency(const VectorXd& motion, double dt, Index block, Index near) {
  constexpr Index kReach = 5;  // lines of a flat top's main lobe
  const signal::AmplitudeSpectrum s =
      signal::amplitude_spectrum(motion, dt, {.window = signal::Window::hann, .block = block});
  const Index first = std::max<Index>(near - kReach, 1), end = std::min(near + kReach + 1, s.amplitude.size() - 1);
  if (first >= end) return s.frequency[near];
  Index at = 0;
  s.amplitude.segment(first, end - first).maxCoeff(&at);
  at += first;
  const double left = s.amplitude[at - 1], right = s.amplitude[at + 1], ratio = std::max(left, right) / s.amplitude[at];
  const double shift = std::clamp((2 * ratio - 1) / (ratio + 1), 0.0, 0.5);
  return s.frequency[at] + (right > left ? shift : -shift) * (s.frequency[1] - s.frequency[0]);
}

void find_largest_line(const VectorXd& x, double dt, ChannelVibration& out) {
  const Index block = std::min(x.size(), static_cast<Index>(std::lround(kLongestBlock / dt)));
  if (block < 16) return;
  const VectorXd motion = x.array() - out.mean;
  const signal::AmplitudeSpectrum s =
      signal::amplitude_spectrum(motion, dt, {.window = signal::Window::flat_top, .block = block});
  Index at = 0;
  // The flat top states amplitudes between lines too; its first lines hold the slowest motion of the block.
  const Index first = 6, lines = s.amplitude.size() - first;
  if (lines < 1) return;
  out.line = s.amplitude.tail(lines).maxCoeff(&at);
  out.frequency = out.line > 0 ? tone_frequency(motion, dt, block, at + first) : 0;
}

/// Has the record a force of short blows? Noise and sines of a shaker have a crest factor below 6.
bool has_blows(const Recording& record) {
  constexpr double kCrest = 10;
  return std::ranges::any_of(record.channels, [](const Channel& c) {
    ChannelVibration force;
    return c.quantity == Quantity::force && describe(c.samples, force) && force.largest > kCrest * force.rms;
  });
}

SynchronousPart synchronous_part(const signal::SynchronousCurve& curve, bool steady) {
  if (steady) return {std::abs(curve.vector.mean()), curve.speed.mean(), true};
  Index top = 0;
  const double amplitude = curve.vector.cwiseAbs().maxCoeff(&top);
  return {amplitude, curve.speed[top], false};
}

}  // namespace

bool at_one_speed(const Rotation& rotation) {
  return rotation.speed.maxCoeff() - rotation.speed.minCoeff() <= 2 * kOneSpeed * rotation.speed.mean();
}

signal::SynchronousCurve shown_curve(const Recording& record, const Rotation& rotation, const std::string& channel,
                                     double order, int turns, double slow_roll) {
  constexpr Index kTurns = 32;
  signal::SynchronousCurve curve = order_curve(record, rotation, channel, order, turns, slow_roll);
  const Index n = curve.vector.size(), window = std::min(kTurns, n);
  if (turns != 1 || window < 3 || !at_one_speed(rotation)) return curve;
  VectorXd weight(window);
  for (Index i = 0; i < window; ++i)
    weight[i] = 1 - std::cos(kTwoPi * (static_cast<double>(i) + 0.5) / static_cast<double>(window));
  weight /= weight.sum();
  const Eigen::VectorXcd vector = curve.vector;
  for (Index b = 0; b < n; ++b) {
    const Index first = std::clamp<Index>(b - window / 2, 0, n - window);
    curve.vector[b] = vector.segment(first, window).cwiseProduct(weight.cast<std::complex<double>>()).sum();
  }
  return curve;
}

HousingZone housing_zone(const ChannelVibration& channel, const MachineClass& machine) {
  const signal::BandLevel& level = *channel.housing;
  const std::optional<SynchronousPart>& first = channel.synchronous;
  const bool part = level.high < signal::Band{}.high || (first && first->steady && first->speed < kTwoPi * level.low);
  const char zone = housing_vibration_zone(level.rms, machine);
  return {zone, part && zone != 'D'};
}

bool of_a_housing(const Channel& channel, const Recording& record) {
  if (channel.quantity != Quantity::velocity && channel.quantity != Quantity::acceleration) return false;
  // A hammer, a shaker or a controller: a test or a loop, whose signals are no vibration of a machine in operation.
  if (std::ranges::any_of(record.channels, [](const Channel& c) { return c.quantity == Quantity::force; }))
    return false;
  const Channel* state = channel.name.starts_with("d") ? record.find(channel.name.substr(1)) : nullptr;
  return state == nullptr || state->quantity != Quantity::displacement;
}

std::vector<ChannelVibration> vibration_of(const Recording& record, const std::optional<Rotation>& rotation,
                                           double slow_roll) {
  std::vector<ChannelVibration> out;
  const bool struck = has_blows(record);
  for (const Channel& c : record.channels) {
    const auto to_velocity = signal::integrations(c.quantity, Quantity::velocity);
    ChannelVibration v;
    v.channel = c.name;
    v.quantity = c.quantity;
    if (!to_velocity || !describe(c.samples, v)) continue;
    v.struck = struck;
    if (c.samples.allFinite()) {
      if (!struck) find_largest_line(c.samples, record.dt, v);
      if (rotation) {
        const signal::SynchronousCurve curve = order_curve(record, *rotation, c.name, 1, 1, slow_roll);
        if (curve.vector.size() > 0) v.synchronous = synchronous_part(curve, at_one_speed(*rotation));
      }
    }
    if (of_a_housing(c, record)) v.housing = signal::band_level(c.samples, record.dt, *to_velocity);
    out.push_back(std::move(v));
  }
  return out;
}

}  // namespace whirl::diagnosis
