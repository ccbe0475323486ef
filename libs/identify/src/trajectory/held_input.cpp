#include "trajectory/held_input.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/signal/resample.hpp"

namespace whirl::identification::detail {
namespace {

constexpr int kFine = 8;

/// Cubic through four points around the interval of `at`: value, or slope per sample of `x`.
double cubic(const Eigen::VectorXd& x, double at, bool slope) {
  const Eigen::Index last = x.size() - 1;
  const Eigen::Index i = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::floor(at)), 0, last - 1);
  const double s = at - static_cast<double>(i);
  const double b = x[i], c = x[i + 1];
  const double a = i > 0 ? x[i - 1] : 2 * b - c, d = i + 2 <= last ? x[i + 2] : 2 * c - b;
  const double c1 = (-2 * a - 3 * b + 6 * c - d) / 6, c2 = (a - 2 * b + c) / 2, c3 = (-a + 3 * b - 3 * c + d) / 6;
  return slope ? c1 + s * (2 * c2 + 3 * s * c3) : b + s * (c1 + s * (c2 + s * c3));
}

}  // namespace

HeldInput::HeldInput(const Eigen::Ref<const Eigen::VectorXd>& samples, Hold hold)
    : hold_(samples.size() < 3 && hold == Hold::band_limited ? Hold::first : hold), samples_(samples) {
  if (hold_ == Hold::band_limited) samples_ = signal::upsample(samples, kFine);
}

double HeldInput::value(double at) const {
  const double last = static_cast<double>(samples_.size() - 1);
  at = std::clamp(hold_ == Hold::band_limited ? at * kFine : at, 0.0, last);
  if (hold_ == Hold::band_limited) return cubic(samples_, at, false);
  const double below = std::min(std::floor(at), last);
  const auto i = static_cast<Eigen::Index>(below);
  if (hold_ == Hold::zero || below == last) return samples_[i];
  return samples_[i] + (at - below) * (samples_[i + 1] - samples_[i]);
}

double HeldInput::slope(double at) const {
  const double last = static_cast<double>(samples_.size() - 1), scale = hold_ == Hold::band_limited ? kFine : 1;
  at *= scale;
  if (hold_ == Hold::zero || at < 0 || at > last || last < 1) return 0;
  if (hold_ == Hold::band_limited) return scale * cubic(samples_, at, true);
  const auto i = static_cast<Eigen::Index>(std::min(std::floor(at), last - 1));
  return samples_[i + 1] - samples_[i];
}

Eigen::VectorXd read_before(const Eigen::Ref<const Eigen::VectorXd>& samples, double shift, bool keep_ends) {
  Eigen::VectorXd out = samples;
  each_whole_stretch(samples, [&](Eigen::Index first, Eigen::Index count) {
    const HeldInput signal(samples.segment(first, count), Hold::band_limited);
    for (Eigen::Index i = 0; i < count; ++i) {
      const double at = static_cast<double>(i) - shift;
      const bool outside = at < 0 || at > static_cast<double>(count - 1);
      out[first + i] = outside && !keep_ends ? std::numeric_limits<double>::quiet_NaN() : signal.value(at);
    }
  });
  return out;
}

std::vector<HeldStep> held_steps(const std::vector<HeldInput>& inputs, const Eigen::VectorXd& dead_samples,
                                 Eigen::Index first, Eigen::Index count, int substeps) {
  constexpr double kSame = 1e-9;
  // The same pattern in every sample interval: beginnings of steps as fractions of it.
  struct Begin {
    double at;
    std::uint64_t switched;
  };
  std::vector<Begin> all;
  for (int k = 0; k < substeps; ++k) all.push_back({static_cast<double>(k) / substeps, 0});
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    if (inputs[j].hold() == Hold::band_limited) continue;
    const double d = dead_samples[static_cast<Eigen::Index>(j)];
    all.push_back({d - std::floor(d), inputs[j].hold() == Hold::zero ? std::uint64_t{1} << (j % 64) : 0});
  }
  std::sort(all.begin(), all.end(), [](const Begin& a, const Begin& b) { return a.at < b.at; });
  std::vector<Begin> begins;
  for (const Begin& b : all) {
    if (!begins.empty() && b.at - begins.back().at < kSame)
      begins.back().switched |= b.switched;
    else
      begins.push_back(b);
  }
  std::vector<HeldStep> steps;
  steps.reserve(static_cast<std::size_t>(count) * begins.size());
  for (Eigen::Index i = 0; i + 1 < count; ++i) {
    const double at = static_cast<double>(first + i);
    for (std::size_t k = 0; k < begins.size(); ++k) {
      const double end = k + 1 < begins.size() ? begins[k + 1].at : 1;
      steps.push_back({at + begins[k].at, end - begins[k].at, k == 0, begins[k].switched});
    }
  }
  return steps;
}

}  // namespace whirl::identification::detail
