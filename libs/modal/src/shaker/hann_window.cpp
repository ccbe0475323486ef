#include "whirl/modal/hann_window.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/modal/residues.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;
constexpr double kDecay = 8;   // sigma of the exponential window over a block
constexpr double kSeen = 0.6;  // share of the block up to which the impulse response is restored
constexpr double kSplit = 3;   // lines between the poles of one split peak
constexpr Index kEdge = 6;     // lines dropped at either end

// Autocorrelation of a Hann window at a lag of `t` blocks, 1 at t = 0.
double autocorrelation(double t) {
  return (1 - t) * (2 + std::cos(2 * kPi * t)) / 3 + std::sin(2 * kPi * t) / (2 * kPi);
}

// exp(-sigma t) over the autocorrelation, carried on smoothly to what belongs to t < 0 (the ringing of a band that
// ends) at the end of the block: then only near lines are mixed.
double exchange(double t) {
  const auto early = [](double at) { return std::exp(-kDecay * at) / autocorrelation(at); };
  if (t <= kSeen) return early(t);
  const double x = (t - kSeen) / (1 - kSeen), step = 1e-5, width = 1 - kSeen;
  const double begin = early(kSeen), slope = (begin - early(kSeen - step)) / step * width;
  // Cubic through both ends with their slopes.
  return begin * (1 + 2 * x) * (1 - x) * (1 - x) + slope * x * (1 - x) * (1 - x) + x * x * (3 - 2 * x) -
         kDecay * width * x * x * (x - 1);
}

// The lines with mirror images at both ends, so that a window mixes none with zeros.
Eigen::VectorXcd carried_on(const Eigen::VectorXcd& lines) {
  const Index n = lines.size(), more = std::min<Index>(n - 1, 32);
  Eigen::VectorXcd all(n + 2 * more);
  all.segment(more, n) = lines;
  for (Index i = 1; i <= more; ++i) {
    const double fade = 0.5 + 0.5 * std::cos(kPi * static_cast<double>(i) / static_cast<double>(more + 1));
    all[more - i] = fade * (2.0 * lines[0] - lines[i]);
    all[more + n - 1 + i] = fade * (2.0 * lines[n - 1] - lines[n - 1 - i]);
  }
  return all;
}

// The lines of an impulse response that is multiplied by `factor` of the time in blocks. Line numbers only turn the
// phase of the impulse response, which leaves its product as it is.
template <typename Factor>
Eigen::VectorXcd multiplied(const Eigen::VectorXcd& lines, Factor factor) {
  const Eigen::VectorXcd all = carried_on(lines);
  Eigen::VectorXcd time = signal::inverse_fft(all);
  const double n = static_cast<double>(time.size());
  for (Index i = 0; i < time.size(); ++i) time[i] *= factor(static_cast<double>(i) / n);
  return signal::fft(time).segment((all.size() - lines.size()) / 2, lines.size());
}

}  // namespace

FrequencyResponse without_hann_window(const FrequencyResponse& frf) {
  const Index n = frf.frequency.size();
  if (n < 64) throw Error(fmt::format("a Hann window can be taken off 64 lines or more, there are {}", n));
  if (frf.window_decay != 0 || frf.leakage_free)
    throw Error("a Hann window cannot be taken off: the FRFs state an exponential window, or that there was none");
  for (const FrfChannel& channel : frf.channels) {
    if (!channel.value.allFinite())
      throw Error("channel " + channel.response + "/" + channel.reference + " holds values that are no numbers");
  }
  const double df = (frf.frequency[n - 1] - frf.frequency[0]) / static_cast<double>(n - 1);
  FrequencyResponse result = frf;
  result.frequency = frf.frequency.segment(kEdge, n - 2 * kEdge);
  result.window_decay = kDecay * df;
  double power = 0;  // of noise that is even over the block
  constexpr int kTimes = 1000;
  for (int i = 0; i < kTimes; ++i) power += std::pow(exchange((i + 0.5) / kTimes), 2) / kTimes;
  for (FrfChannel& channel : result.channels) {
    channel.value = multiplied(channel.value, exchange).segment(kEdge, n - 2 * kEdge).eval();
    channel.coherence.resize(0);
    if (channel.variance.size() == n)
      channel.variance = (power * channel.variance.segment(kEdge, n - 2 * kEdge)).eval();
  }
  return result;
}

void state_exponential_window(FrequencyResponse& frf, double end) {
  if (frf.window_decay != 0)
    throw Error(fmt::format("--window-end-percent: the file states an exponential window itself, of {:.4g} 1/s",
                            frf.window_decay));
  if (frf.frequency.size() < 2) throw Error("--window-end-percent: needs two lines or more");
  // A record is as long as one over the distance of its lines.
  frf.window_decay = -std::log(end) * (frf.frequency[1] - frf.frequency[0]);
}

bool looks_split(const FrequencyResponse& frf, const ModalModel& model) {
  const Index n = frf.frequency.size();
  if (n < 64 || frf.window_decay != 0 || frf.leakage_free || model.modes.size() < 2) return false;
  const double reach = kSplit * 2 * kPi * (frf.frequency[n - 1] - frf.frequency[0]) / static_cast<double>(n - 1);
  const auto split = std::count_if(model.modes.begin(), model.modes.end(), [&](const Mode& mode) {
    return std::any_of(model.modes.begin(), model.modes.end(),
                       [&](const Mode& other) { return &other != &mode && std::abs(other.pole - mode.pole) < reach; });
  });
  return 2 * static_cast<std::size_t>(split) >= model.modes.size();
}

double error_through_hann_window(const FrequencyResponse& measured, const FrequencyResponse& without,
                                 const ModalModel& model) {
  const Index n = measured.frequency.size();
  double left = 0, all = 0;
  for (std::size_t c = 0; c < measured.channels.size(); ++c) {
    const Eigen::VectorXcd rest =
        without.channels[c].value -
        synthesise(model, static_cast<Index>(c), without.frequency, without.kind, without.window_decay);
    left += multiplied(rest, [](double t) { return 1 / exchange(t); }).squaredNorm();
    all += measured.channels[c].value.segment(kEdge, n - 2 * kEdge).squaredNorm();
  }
  return std::sqrt(left / all);
}

}  // namespace whirl::modal
