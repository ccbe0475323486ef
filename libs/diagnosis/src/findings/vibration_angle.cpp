#include "findings/vibration_angle.hpp"

#include <algorithm>
#include <cmath>

#include "findings/channel_study.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::diagnosis::detail {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr Index kLeastCycles = 32;
constexpr Index kFollowed = 16;           // cycles of a block
constexpr double kHalf = 0.5;             // of the largest line: more at half its frequency is 1X, less is 0.5X
constexpr double kFollowedStep = 1;       // rad between blocks: beyond it the phase is lost
constexpr double kSteadySize = 0.5;       // of the median of the blocks: less is a decay or a resonance under noise
constexpr double kAbove = 50;             // times the median power of the lines beside it: noise reaches 15 in 30 000
constexpr Index kBeside = 40, kLobe = 4;  // lines to either side of a line, without those of its window

bool is_electric(double frequency, double line, const std::vector<double>& mains) {
  return std::ranges::any_of(mains, [&](double m) {
    return std::abs(frequency - m) < kMainsTolerance * m + line ||
           std::abs(frequency - 2 * m) < kMainsTolerance * 2 * m + line;
  });
}

double median_of(VectorXd v) {
  std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
  return v[v.size() / 2];
}

// A line above those beside it; 1/f noise stands above the median of all.
bool stands_out(const VectorXd& amplitude, Index line) {
  std::vector<double> beside;
  for (Index k = std::max<Index>(1, line - kLobe - kBeside); k < std::min(line + kLobe + kBeside + 1, amplitude.size());
       ++k)
    if (std::abs(k - line) > kLobe) beside.push_back(amplitude[k]);
  if (static_cast<Index>(beside.size()) < kBeside) return false;
  const auto n = static_cast<Index>(beside.size());
  return amplitude[line] > std::sqrt(kAbove) * median_of(Eigen::Map<const VectorXd>(beside.data(), n));
}

}  // namespace

std::optional<Rotation> vibration_angle(const VectorXd& samples, double dt, const std::vector<double>& mains,
                                        bool& halved) {
  const Index n = samples.size();
  if (n < 256) return std::nullopt;
  const VectorXd x = samples.array() - samples.mean();
  const signal::AmplitudeSpectrum s = signal::amplitude_spectrum(x, dt);
  const double line = s.frequency[1];
  Index top = 0;
  for (Index k = kLeastCycles; k + 1 < s.amplitude.size(); ++k) {
    if (s.frequency[k] < kUsedBand / dt && s.amplitude[k] > (top > 0 ? s.amplitude[top] : 0.0) &&
        !is_electric(s.frequency[k], 2 * line, mains))
      top = k;
  }
  if (top == 0 || !stands_out(s.amplitude, top)) return std::nullopt;
  const Index half = top / 2;
  if (half >= kLeastCycles) {
    Index near = half;
    for (const Index k : {half - 1, half + 1, half + 2})
      if (s.amplitude[k] > s.amplitude[near]) near = k;
    if (!is_electric(s.frequency[near], 2 * line, mains) && stands_out(s.amplitude, near)) {
      // 0.5X and 1X, or 1X and 2X: the sizes are all that speaks.
      halved = true;
      if (s.amplitude[near] > kHalf * s.amplitude[top]) top = near;
    }
  }
  const double turning = s.frequency[top];
  const auto block = static_cast<Index>(std::lround(static_cast<double>(kFollowed) / (turning * dt)));
  const Index blocks = n / block;
  if (blocks < 2) return std::nullopt;
  std::vector<double> phase;
  VectorXd size(blocks);
  for (Index b = 0; b < blocks; ++b) {
    std::complex<double> sum = 0;
    for (Index i = 0; i < block; ++i) {
      const double weight = 1 - std::cos(kTwoPi * (static_cast<double>(i) + 0.5) / static_cast<double>(block));
      sum += weight * x[b * block + i] * std::polar(1.0, -kTwoPi * turning * dt * static_cast<double>(b * block + i));
    }
    const double here = std::arg(sum), moved = phase.empty() ? 0 : std::remainder(here - phase.back(), kTwoPi);
    if (std::abs(moved) > kFollowedStep) return std::nullopt;
    phase.push_back(phase.empty() ? here : phase.back() + moved);
    size[b] = std::abs(sum);
  }
  const double usual = median_of(size);
  if (size.minCoeff() < kSteadySize * usual || size.maxCoeff() > usual / kSteadySize) return std::nullopt;
  Rotation out;
  out.angle.resize(n);
  out.speed.resize(n);
  for (Index i = 0; i < n; ++i) {
    const double place = std::clamp((static_cast<double>(i) + 0.5) / static_cast<double>(block) - 0.5, 0.0,
                                    static_cast<double>(blocks - 1));
    const auto b = std::min(static_cast<std::size_t>(place), phase.size() - 2);
    const double slope = phase[b + 1] - phase[b];
    out.angle[i] = kTwoPi * turning * dt * static_cast<double>(i) + phase[b] + slope * (place - static_cast<double>(b));
    out.speed[i] = kTwoPi * turning + slope / (static_cast<double>(block) * dt);
  }
  return out;
}

}  // namespace whirl::diagnosis::detail
