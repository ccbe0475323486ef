#include <algorithm>
#include <cmath>
#include <map>

#include "findings/channel_study.hpp"
#include "findings/vibration_angle.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/passages.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/diagnosis/vibration.hpp"
#include "whirl/signal/order.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kMostMissing = 0.02;                          // of the samples of a channel
constexpr Index kLeastRecord = 32;                             // turns
constexpr double kHighestOrder = 8.5, kHighestElectric = 130;  // Hz
constexpr Index kShortTurns = 64;
constexpr double kWellApart = 0.5, kToldApart = 0.75;  // share of a line in a block; of the blocks
constexpr int kFewestSteps = 32, kMostSteps = 256;     // of a turn

// Every kind of finding, in the order in which they need each other.
constexpr void (*kFinders[])(detail::ChannelStudy&) = {detail::find_electric,  detail::find_subsynchronous,
                                                       detail::find_orders,    detail::find_phase_scatter,
                                                       detail::find_sidebands, detail::find_run_out};

bool vibrates(const Channel& c) {
  return c.quantity == Quantity::displacement || c.quantity == Quantity::velocity ||
         c.quantity == Quantity::acceleration;
}

// Straight lines over missing samples; nothing where too many are missing.
std::optional<VectorXd> bridged(const VectorXd& samples) {
  const Index n = samples.size(), missing = n - samples.array().isFinite().count();
  if (static_cast<double>(missing) > kMostMissing * static_cast<double>(n)) return std::nullopt;
  return gaps_bridged(samples);
}

double smallest_step(const VectorXd& v) {
  double step = INFINITY;
  for (Index i = 1; i < v.size(); ++i)
    if (v[i] != v[i - 1]) step = std::min(step, std::abs(v[i] - v[i - 1]));
  return std::isfinite(step) ? step : 0;
}

detail::AngularChannel over_angle(const Channel& c, const VectorXd& samples, const Rotation& turning, double dt) {
  std::vector<double> sorted(turning.speed.begin(), turning.speed.end());
  const auto slow = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 10);
  std::nth_element(sorted.begin(), slow, sorted.end());
  const double orders = std::max(kHighestOrder, kHighestElectric * kTwoPi / std::max(*slow, 1e-6));
  const int steps = 2 * static_cast<int>(std::ceil(std::min(1.4 * orders, 0.5 * kMostSteps)));
  detail::AngularChannel out;
  out.name = c.name;
  out.quantity = c.quantity;
  out.per_turn = std::clamp(steps, kFewestSteps, kMostSteps);
  signal::AngularSignal a =
      signal::resample_in_angle(samples.segment(turning.first, turning.size()), turning.angle, dt, out.per_turn);
  out.samples = std::move(a.samples);
  out.time = a.time.array() + dt * static_cast<double>(turning.first);
  out.rate = 1 / dt;
  out.quantum = smallest_step(samples);
  return out;
}

void mark_remarkable(VibrationFindings& result, std::string_view channel, double largest) {
  for (VibrationFinding& f : result.findings) {
    if (f.channel != channel || f.code == VibrationCode::first_order) continue;
    f.remarkable = f.code == VibrationCode::phase_scatter || f.size >= detail::kRemarkableLine * largest;
  }
}

// With the measured angle, else that of the channel of displacement or motion that tells one.
std::optional<Rotation> angle_of(const Recording& record, const VibrationOptions& options, AngleSource& source,
                                 bool& halved) {
  if (auto turning = rotation_of(record)) {
    source = AngleSource::measured;
    return turning;
  }
  for (const Channel& c : record.channels) {
    const auto samples = vibrates(c) ? bridged(c.samples) : std::nullopt;
    if (!samples) continue;
    if (auto turning = detail::vibration_angle(*samples, record.dt, options.mains, halved)) {
      source = AngleSource::vibration;
      return turning;
    }
  }
  return std::nullopt;
}

// The line in the shortest blocks that tell it from the orders: a supply wanders.
ElectricLine through_record(const detail::ChannelStudy& study, const detail::Line& line) {
  std::vector<double> time;
  std::vector<std::complex<double>> vector;
  const auto collect = [&](const std::vector<detail::LineBlock>& blocks, double share) {
    time.clear();
    vector.clear();
    for (const detail::LineBlock& b : blocks) {
      const detail::LineValue v = b.fitted(line);
      if (!(v.share >= share)) continue;
      time.push_back(b.middle());
      vector.push_back(v.vector);
    }
    return static_cast<double>(time.size()) >= kToldApart * static_cast<double>(blocks.size());
  };
  std::vector<detail::Line> lines = detail::order_lines();
  lines.insert(lines.end(), study.electric.begin(), study.electric.end());
  if (!collect(detail::blocks_of(study.channel, lines, kShortTurns, detail::kSteadyRecord), kWellApart))
    collect(study.blocks, detail::kLeastShare);
  const auto n = static_cast<Index>(time.size());
  return {study.channel.name, line.frequency, Eigen::Map<const VectorXd>(time.data(), n),
          Eigen::Map<const Eigen::VectorXcd>(vector.data(), n)};
}

void study_channel(const Channel& c, const Recording& record, const Rotation& turning, const VibrationOptions& options,
                   double tests, VibrationFindings& result) {
  const std::optional<VectorXd> samples = bridged(c.samples);
  if (!samples) return result.unjudged.push_back({c.name, std::nullopt, UnjudgedReason::gaps});
  if (turning.angle[turning.size() - 1] - turning.angle[0] < kTwoPi * static_cast<double>(kLeastRecord + 1))
    return result.unjudged.push_back({c.name, std::nullopt, UnjudgedReason::too_few_turns});
  const detail::AngularChannel channel = over_angle(c, *samples, turning, record.dt);
  detail::ChannelStudy study{.channel = channel,
                             .options = options,
                             .phase = result.angle == AngleSource::measured,
                             .tests = tests,
                             .result = result};
  const auto before = static_cast<std::ptrdiff_t>(result.findings.size());
  for (const auto find : kFinders) find(study);
  std::sort(result.findings.begin() + before, result.findings.end(),
            [](const VibrationFinding& a, const VibrationFinding& b) { return a.code < b.code; });
  mark_remarkable(result, c.name, study.largest);
  for (const detail::Line& l : study.electric) result.electric.push_back(through_record(study, l));
}

}  // namespace

namespace detail {

bool ChannelStudy::runs() const { return result.high_speed > (1 + kSteadyRecord) * result.low_speed; }

bool ChannelStudy::add(VibrationFinding f) {
  f.channel = channel.name;
  f.quantity = channel.quantity;
  f.chance = std::min(1.0, f.chance * tests);
  const bool line = f.code != VibrationCode::phase_scatter;
  if (!(f.chance < options.chance) || (line && (f.size < kLeastLine * largest || 2 * f.size < channel.quantum)))
    return false;
  result.findings.push_back(std::move(f));
  return true;
}

void ChannelStudy::unjudged(VibrationCode code, UnjudgedReason reason) {
  result.unjudged.push_back({channel.name, code, reason});
}

double ChannelStudy::mean_amplitude(const std::vector<LineValue>& values) {
  double sum = 0, count = 0;
  for (const LineValue& v : values) {
    if (!(v.share >= kLeastShare)) continue;
    sum += std::norm(v.vector);
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

}  // namespace detail

VectorXd ElectricLine::taken_off(const VectorXd& samples, double dt) const {
  VectorXd out = samples;
  Index k = 0;
  for (Index i = 0; i < samples.size() && time.size() > 0; ++i) {
    const double t = dt * static_cast<double>(i);
    while (k + 2 < time.size() && time[k + 1] < t) ++k;
    std::complex<double> z = vector[k];
    if (time.size() > 1)
      z += std::clamp((t - time[k]) / (time[k + 1] - time[k]), 0.0, 1.0) * (vector[k + 1] - vector[k]);
    out[i] -= (z * std::polar(1.0, kTwoPi * frequency * t)).real();
  }
  return out;
}

const VibrationFinding* VibrationFindings::find(VibrationCode code, std::string_view channel) const {
  for (const VibrationFinding& f : findings)
    if (f.code == code && (channel.empty() || f.channel == channel)) return &f;
  return nullptr;
}

namespace {

/// After a passage the rotor rings at its natural frequency, which lies at or below the speed of the largest vector (a
/// fast run or a hardening spring shifts it up). Where half an order or a whirl has that frequency, it may be this.
/// What is seen before the passage too was not set ringing by it.
bool rings(const VibrationFinding& f, const Passage& p, bool speeds_up) {
  constexpr double kLowest = 0.7, kHighest = 1.1;
  const double ratio = f.order * f.speed / p.speed;
  return ratio > kLowest && ratio < kHighest && (speeds_up ? f.low_speed > p.speed : f.high_speed < p.speed);
}

/// A run through a resonance turns the 1X vector within a block of turns, whose mean is too small: there the largest
/// vector of a turn is the size, as in a Bode plot.
void read_runs_by_turn(Recording record, const Rotation& turning, VibrationFindings& result) {
  if (at_one_speed(turning)) return;
  for (Channel& c : record.channels)
    if (std::optional<VectorXd> whole = bridged(c.samples)) c.samples = *std::move(whole);
  const bool speeds_up = turning.speed[turning.size() - 1] > turning.speed[0];
  std::map<std::string, std::vector<Passage>> passed;
  for (VibrationFinding& f : result.findings) {
    if (f.code != VibrationCode::first_order) continue;
    const signal::SynchronousCurve curve = order_curve(record, turning, f.channel);
    if (curve.vector.size() == 0) continue;
    Eigen::Index at = 0;
    f.size = curve.vector.cwiseAbs().maxCoeff(&at);
    f.speed = curve.speed[at];
    std::vector<Passage>& list = passed[f.channel] = passages(curve);
    list.push_back({at, f.speed, f.size, f.speed});
  }
  for (VibrationFinding& f : result.findings) {
    if (f.code != VibrationCode::half_orders && f.code != VibrationCode::subsynchronous) continue;
    if (std::ranges::any_of(passed[f.channel], [&](const Passage& p) { return rings(f, p, speeds_up); }))
      f.causes.insert(f.causes.begin(), Cause::free_vibration);
  }
}

}  // namespace

VibrationFindings find_vibration(const Recording& record, const VibrationOptions& options) {
  require_range("dt", record.dt, std::numeric_limits<double>::min(), 1e6, "s");
  require_range("chance", options.chance, 1e-12, 0.5);
  VibrationFindings result;
  const auto channels = std::ranges::count_if(record.channels, vibrates);
  if (channels == 0) return result;
  bool halved = false;
  const std::optional<Rotation> turning = angle_of(record, options, result.angle, halved);
  if (!turning) {
    for (const Channel& c : record.channels)
      if (vibrates(c)) result.unjudged.push_back({c.name, std::nullopt, UnjudgedReason::no_angle});
    return result;
  }
  result.low_speed = turning->speed.minCoeff();
  result.high_speed = turning->speed.maxCoeff();
  const double tests = static_cast<double>(channels) * kVibrationCodes;
  for (const Channel& c : record.channels)
    if (vibrates(c)) study_channel(c, record, *turning, options, tests, result);
  read_runs_by_turn(record, *turning, result);
  if (halved) result.unjudged.push_back({"", VibrationCode::half_orders, UnjudgedReason::half_or_first});
  return result;
}

std::string_view to_string(VibrationCode code) {
  constexpr std::string_view names[] = {
      "first_order",    "second_order",         "harmonics", "half_orders",   "subsynchronous",
      "line_frequency", "twice_line_frequency", "sidebands", "phase_scatter", "run_out"};
  static_assert(std::size(names) == kVibrationCodes);
  return names[static_cast<std::size_t>(code)];
}

std::string_view to_string(Cause cause) {
  constexpr std::string_view names[] = {"unbalance", "bent_shaft",    "misalignment",  "unequal_stiffness",
                                        "oil_whirl", "oil_whip",      "looseness",     "rub",
                                        "electric",  "pickup",        "modulation",    "run_out",
                                        "thermal",   "other_machine", "free_vibration"};
  return names[static_cast<std::size_t>(cause)];
}

std::string_view to_string(UnjudgedReason reason) {
  constexpr std::string_view names[] = {"no_angle",       "too_few_turns", "gaps",           "speed_changes",
                                        "line_beside_1x", "no_slow_turns", "few_slow_turns", "half_or_first"};
  return names[static_cast<std::size_t>(reason)];
}

}  // namespace whirl::diagnosis
