#include "whirl/monitor/spectrum_average.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::monitor {

using Eigen::Index;

Index block_for(double rate) {
  return static_cast<Index>(std::bit_ceil(static_cast<std::uint64_t>(std::clamp(rate / 1.25, 256.0, 32768.0))));
}

SpectrumAverage::SpectrumAverage(Index channels, double rate, const SpectrumSettings& settings,
                                 std::pair<Index, Index> orbit)
    : rate_(rate), settings_(settings), orbit_(orbit) {
  require_range("block", static_cast<double>(settings.block), 64, 65536, "samples");
  require_range("overlap", settings.overlap, 0, 0.9);
  require_range("averages", settings.averages, 1, 1000);
  buffer_.resize(settings.block, channels);
  reset();
}

void SpectrumAverage::reset() {
  filled_ = 0;
  count_ = skipped_ = bridged_ = 0;
  counts_.assign(static_cast<std::size_t>(buffer_.cols()) + 1, 0);
  power_ = Eigen::MatrixXd::Zero(settings_.block / 2 + 1, buffer_.cols());
  full_power_ = Eigen::VectorXd::Zero(orbit_.second < 0 ? 0 : 2 * ((settings_.block - 1) / 2) + 1);
  latest_.resize(0, 0);
}

int SpectrumAverage::push(const Eigen::Ref<const Eigen::MatrixXd>& samples) {
  int blocks = 0;
  for (Index from = 0; from < samples.rows();) {
    const Index count = std::min(samples.rows() - from, settings_.block - filled_);
    buffer_.middleRows(filled_, count) = samples.middleRows(from, count);
    filled_ += count;
    from += count;
    if (filled_ < settings_.block) break;
    average_block();
    ++blocks;
    const Index step =
        std::max<Index>(1, static_cast<Index>((1 - settings_.overlap) * static_cast<double>(settings_.block)));
    filled_ = settings_.block - step;
    const Eigen::MatrixXd kept = buffer_.bottomRows(filled_);
    buffer_.topRows(filled_) = kept;
  }
  return blocks;
}

Eigen::VectorXd SpectrumAverage::whole(Index channel) const {
  Eigen::VectorXd x = buffer_.col(channel);
  const Index n = x.size(), lost = n - x.array().isFinite().count();
  if (lost == 0) return x;
  if (100 * lost > n) return {};
  for (Index i = 0; i < n; ++i) {
    if (std::isfinite(x(i))) continue;
    Index end = i;
    while (end < n && !std::isfinite(x(end))) ++end;
    // At the rim of the block the nearest value stands.
    const double left = i > 0 ? x(i - 1) : x(end), right = end < n ? x(end) : left;
    for (Index k = i; k < end; ++k)
      x(k) = left + (right - left) * static_cast<double>(k - i + 1) / static_cast<double>(end - i + 1);
    i = end;
  }
  return x;
}

void SpectrumAverage::average_block() {
  const bool orbit = full_power_.size() > 0;
  const Index first = orbit ? orbit_.first : 0, second = orbit ? orbit_.second : 0;
  const Eigen::VectorXd x = whole(first), y = whole(second);
  if (x.size() == 0 || y.size() == 0) {
    ++skipped_;
    return;
  }
  if (!buffer_.col(first).allFinite() || !buffer_.col(second).allFinite()) ++bridged_;
  const signal::SpectrumOptions options{.window = settings_.window, .kind = AmplitudeKind::peak};
  const bool full = settings_.averaging == Averaging::linear && count_ >= settings_.averages;
  if (!full) ++count_;
  latest_ = Eigen::MatrixXd::Zero(power_.rows(), power_.cols());
  for (Index c = 0; c < buffer_.cols(); ++c) {
    const Eigen::VectorXd samples = whole(c);
    if (samples.size() == 0) continue;
    latest_.col(c) = signal::amplitude_spectrum(samples, 1 / rate_, options).amplitude;
    if (!full) take(static_cast<std::size_t>(c), power_.col(c), latest_.col(c).cwiseAbs2());
  }
  if (orbit && !full) {
    const signal::AmplitudeSpectrum both = signal::full_spectrum(x, y, 1 / rate_, options);
    // Of an even number of lines the lowest, half the rate, is neither forward nor backward.
    take(counts_.size() - 1, full_power_, both.amplitude.tail(full_power_.size()).cwiseAbs2());
  }
}

void SpectrumAverage::take(std::size_t index, Eigen::Ref<Eigen::VectorXd> average,
                           const Eigen::Ref<const Eigen::VectorXd>& power) {
  const long count = ++counts_[index];
  if (settings_.averaging == Averaging::peak_hold) {
    average = average.cwiseMax(power);
  } else {
    average += (power - average) / static_cast<double>(std::min<long>(count, settings_.averages));
  }
}

}  // namespace whirl::monitor
