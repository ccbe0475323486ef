#include "whirl/signal/tacho.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/order.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::signal {
namespace {

constexpr double kMostPulses = 2000;  // 1/s, of one pulse a turn: 120 000 rpm

struct Levels {
  double bottom = 0, range = 0;
};

/// Levels of the signal but for three samples at either end, which may be disturbances; six pulses are needed anyway.
Levels levels_of(const Eigen::Ref<const Eigen::VectorXd>& signal) {
  constexpr Eigen::Index kWild = 3;
  std::vector<double> sorted(signal.begin(), signal.end());
  const auto nth = [&](Eigen::Index k) {
    std::nth_element(sorted.begin(), sorted.begin() + k, sorted.end());
    return sorted[static_cast<std::size_t>(k)];
  };
  const Eigen::Index last = signal.size() - 1, wild = std::min(kWild, last / 2);
  const double bottom = nth(wild);
  return {bottom, nth(last - wild) - bottom};
}

struct Crossings {
  std::vector<double> times;
  long sampled = 0;  ///< edges that have a sample on their way
};

Crossings rising(const Eigen::VectorXd& signal, double dt, double arm, double level, double range) {
  Crossings out;
  bool armed = signal[0] < arm;
  for (Eigen::Index i = 1; i < signal.size() && range > 0; ++i) {
    if (signal[i] < arm) armed = true;
    if (!armed || signal[i] < level || signal[i - 1] >= level) continue;
    const double part = (level - signal[i - 1]) / (signal[i] - signal[i - 1]);
    out.times.push_back(dt * (static_cast<double>(i - 1) + part));
    out.sampled += signal[i] - signal[i - 1] < 0.9 * range;
    armed = false;
  }
  return out;
}

/// k where the record vibrates most, by far, at 1/k of the rate of the pulses, taken as one a turn; else 1.
int vibration_share(const Recording& record, const Eigen::VectorXd& angle, Eigen::Index first, Eigen::Index count) {
  constexpr int kPerTurn = 8, kLeastLine = 6;
  constexpr double kByFar = 5;
  for (const Channel& c : record.channels) {
    const bool motion = c.quantity == Quantity::displacement || c.quantity == Quantity::velocity ||
                        c.quantity == Quantity::acceleration;
    if (!motion || !c.samples.allFinite()) continue;
    const Eigen::VectorXd x =
        resample_in_angle(c.samples.segment(first, count), angle.segment(first, count), record.dt, kPerTurn).samples;
    const Eigen::VectorXd v = amplitude_spectrum(x, 1.0 / kPerTurn).amplitude;
    const Eigen::Index whole = x.size() / kPerTurn;  // line of order 1, to the nearest below
    if (whole < 4 * kLeastLine) continue;
    Eigen::Index line = 0;
    const double most = v.segment(kLeastLine, (3 * whole) / 4 - kLeastLine).maxCoeff(&line);
    line += kLeastLine;
    if (most < kByFar * v.segment(whole - 2, 5).maxCoeff()) continue;
    const double turns = static_cast<double>(x.size()) / kPerTurn, k = std::round(turns / static_cast<double>(line));
    const bool whole_part = std::abs(turns / k - static_cast<double>(line)) <= 1;
    if (k >= 2 && whole_part) return static_cast<int>(k);
  }
  return 1;
}

/// Evenly spaced pulses do not tell how many pass in a turn: what speaks against one.
void require_one_a_turn(const Recording& record, const Channel& channel, const AngleFit& fit,
                        const std::vector<double>& times) {
  const auto first = static_cast<Eigen::Index>(std::ceil(times.front() / record.dt));
  const Eigen::Index count = static_cast<Eigen::Index>(times.back() / record.dt) - first + 1;
  const auto at_samples = Eigen::seqN(2 * first, count, Eigen::Index{2});
  const double fastest = fit.angle.omega(at_samples).maxCoeff() / kTwoPi;
  if (fastest > kMostPulses)
    throw Error(
        fmt::format("{}: channel {}: {:.0f} evenly spaced pulses a second would be {:.0f} rpm with one a turn: "
                    "state the number a turn (--pulses N, or --pulses 1)",
                    record.source, channel.name, fastest, 60 * fastest));
  Eigen::VectorXd angle = Eigen::VectorXd::Zero(record.size());
  angle.segment(first, count) = fit.angle.beta(at_samples);
  for (Eigen::Index i = first + 1; i < first + count; ++i)
    if (!(angle[i] > angle[i - 1])) return;
  if (count < 64 || angle[first + count - 1] - angle[first] < 8 * kTwoPi) return;
  if (const int k = vibration_share(record, angle, first, count); k > 1)
    throw Error(
        fmt::format("{}: channel {}: evenly spaced pulses, but the record vibrates at about 1/{} of their rate: state "
                    "the number of pulses a turn (--pulses {}, or --pulses 1)",
                    record.source, channel.name, k, k));
}

AngleFit from_speed(const Recording& record, const Channel& channel, std::vector<std::string>& said) {
  Eigen::VectorXd angle(record.size());
  angle[0] = 0;
  for (Eigen::Index i = 1; i < angle.size(); ++i)
    angle[i] = angle[i - 1] + 0.5 * record.dt * (channel.samples[i] + channel.samples[i - 1]);
  said.push_back(fmt::format(
      "angle integrated from the speed of channel {}: phases count from an unknown zero, and drift with the "
      "error of the speed",
      channel.name));
  // Whole turns are no wraps: a step of half a turn a sample is out of reach of any speed that is sampled well.
  return angle_from_encoder(angle, record.dt);
}

}  // namespace

namespace {

/// Whether edges lie at the same place between two samples: a filter behind the converter smeared them, and what lies
/// between tells no more than the sample. Times anywhere come so close together once in 10^17 for 50 of them.
bool all_between_alike(const std::vector<double>& times, double dt) {
  constexpr double kAlike = 0.9;
  std::complex<double> sum = 0;
  for (const double t : times) sum += std::polar(1.0, kTwoPi * std::remainder(t / dt, 1.0));
  return std::abs(sum) > kAlike * static_cast<double>(times.size());
}

}  // namespace

PulseTrain pulse_train(const Eigen::Ref<const Eigen::VectorXd>& signal, double dt, Edge edge, double low,
                       double middle) {
  PulseTrain out;
  if (signal.size() < 2) return out;
  const Levels levels = levels_of(signal);
  if (edge == Edge::automatic) {
    constexpr double kRests = 0.6;  // of the time on the upper level: a notch
    const double half = levels.bottom + 0.5 * levels.range;
    const auto above = static_cast<double>((signal.array() > half).count());
    edge = above > kRests * static_cast<double>(signal.size()) ? Edge::falling : Edge::rising;
  }
  out.edge = edge;
  out.bottom = levels.bottom;
  out.top = levels.bottom + levels.range;
  long sampled = 0;
  const auto add = [&](const Eigen::VectorXd& s, double bottom) {
    const Crossings c = rising(s, dt, bottom + low * levels.range, bottom + middle * levels.range, levels.range);
    out.times.insert(out.times.end(), c.times.begin(), c.times.end());
    sampled += c.sampled;
  };
  if (edge != Edge::falling) add(signal, levels.bottom);
  if (edge != Edge::rising) add(-signal, -levels.bottom - levels.range);
  std::sort(out.times.begin(), out.times.end());
  const bool finer = 2 * sampled > static_cast<long>(out.times.size()) && !all_between_alike(out.times, dt);
  out.quantum = finer ? 0.1 * dt : dt;
  return out;
}

std::vector<double> pulse_times(const Eigen::Ref<const Eigen::VectorXd>& signal, double dt, double low, double middle) {
  return pulse_train(signal, dt, Edge::rising, low, middle).times;
}

bool has_two_levels(const Eigen::Ref<const Eigen::VectorXd>& signal) {
  constexpr double kLevel = 0.2, kBetween = 0.2;  // of the range; of the samples
  if (signal.size() < 2) return false;
  const Levels levels = levels_of(signal);
  const Eigen::ArrayXd part = (signal.array() - levels.bottom) / levels.range;
  const auto between = static_cast<double>((part > kLevel && part < 1 - kLevel).count());
  return levels.range > 0 && between < kBetween * static_cast<double>(signal.size());
}

const Channel* pulse_channel(const Recording& record) {
  for (const char* name : {"key", "keyphasor", "tacho"}) {
    if (const Channel* found = record.find(name)) return found;
  }
  return nullptr;
}

const Channel* speed_channel(const Recording& record) {
  for (const char* name : {"speed", "rpm", "omega"}) {
    const Channel* found = record.find(name);
    if (found != nullptr && found->quantity == Quantity::angular_velocity) return found;
  }
  return nullptr;
}

namespace {

/// Why pulses of few samples each show no pattern; empty: they have enough.
std::string too_slow(Eigen::Index samples, std::size_t pulses) {
  constexpr double kFewSamples = 8;
  const double each = pulses > 0 ? static_cast<double>(samples) / static_cast<double>(pulses) : kFewSamples;
  return each < kFewSamples ? fmt::format(
                                  "; a pulse has {:.1f} samples: the channel is sampled too slowly for its marks "
                                  "({:g} and more show their places)",
                                  each, kFewSamples)
                            : "";
}

}  // namespace

AngleFit angle_of_tacho(const Recording& record, const std::string& name, const TachoOptions& tacho,
                        std::vector<std::string>& said) {
  const Channel* channel = name.empty() ? pulse_channel(record) : &record.at(name);
  if (channel == nullptr) channel = speed_channel(record);
  if (channel == nullptr)
    throw Error(fmt::format("{}: no channel of pulses (key, keyphasor, tacho) and none of a speed", record.source));
  if (!channel->samples.allFinite())
    throw Error(fmt::format("{}: channel {} has gaps: no angle", record.source, channel->name));
  if (channel->quantity == Quantity::angular_velocity) return from_speed(record, *channel, said);
  const PulseTrain train = pulse_train(channel->samples, record.dt, tacho.edge);
  AngleFit fit = [&] {
    try {
      return angle_from_pulses(train.times, record.dt, record.size(), {}, tacho, train.quantum);
    } catch (const Error& e) {
      throw Error(fmt::format("{}: channel {}: {}{}", record.source, channel->name, e.what(),
                              too_slow(record.size(), train.times.size())));
    }
  }();
  if (fit.pattern.assumed) require_one_a_turn(record, *channel, fit, train.times);
  // The number of a few marks is told by their unevenness alone, 4 % or more: the pattern learned must show it.
  constexpr double kShown = 0.01;
  constexpr std::size_t kFew = 4;
  const bool few = fit.pattern.marks.size() > 1 && fit.pattern.marks.size() <= kFew && fit.pattern.missing() == 0;
  if (!tacho.stated() && few && !fit.pattern.assumed && fit.pattern.unevenness() < kShown)
    throw Error(fmt::format("{}: channel {}: {}: too even to tell their number: state it (--pulses N)", record.source,
                            channel->name, fit.pattern.text()));
  said.push_back(fmt::format("angle from channel {}: {}, {} edges{}", channel->name, fit.pattern.text(),
                             train.edge == Edge::rising    ? "rising"
                             : train.edge == Edge::falling ? "falling"
                                                           : "both",
                             fit.pattern.assumed ? " (evenly spaced; if there are more a turn: --pulses N)" : ""));
  for (const std::string& warning : fit.summary.warnings) said.push_back(warning);
  return fit;
}

Recording with_tacho_angle(const Recording& record, const std::string& name, const TachoOptions& tacho,
                           std::vector<std::string>& said) {
  const bool asked = !name.empty() || tacho.stated();
  if (!asked && (record.has("beta") || (pulse_channel(record) == nullptr && speed_channel(record) == nullptr)))
    return record;
  const AngleFit fit = angle_of_tacho(record, name, tacho, said);
  const Channel* pulses = name.empty() ? pulse_channel(record) : &record.at(name);
  const std::string used = pulses == nullptr || pulses->quantity == Quantity::angular_velocity ? "" : pulses->name;
  Recording out = record;
  std::erase_if(out.channels, [&](const Channel& c) { return c.name == "beta" || c.name == used; });
  out.add("beta", Quantity::angle, fit.angle.beta(Eigen::seqN(Eigen::Index{0}, record.size(), Eigen::Index{2})));
  return out;
}

}  // namespace whirl::signal
