#include "whirl/monitor/spectrum_average.hpp"

#include <algorithm>

#include "whirl/core/error.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::monitor {

using Eigen::Index;

SpectrumAverage::SpectrumAverage(Index channels, double rate, const SpectrumSettings& settings, std::pair<Index, Index> orbit)
    : rate_(rate), settings_(settings), orbit_(orbit) {
  require_range("block", static_cast<double>(settings.block), 64, 65536, "samples");
  require_range("overlap", settings.overlap, 0, 0.9);
  require_range("averages", settings.averages, 1, 1000);
  buffer_.resize(settings.block, channels);
  reset();
}

void SpectrumAverage::reset() {
  filled_ = 0;
  count_ = skipped_ = 0;
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
    const Index step = std::max<Index>(1, static_cast<Index>((1 - settings_.overlap) * static_cast<double>(settings_.block)));
    filled_ = settings_.block - step;
    const Eigen::MatrixXd kept = buffer_.bottomRows(filled_);
    buffer_.topRows(filled_) = kept;
  }
  return blocks;
}

void SpectrumAverage::average_block() {
  const auto whole = [&](Index c) { return buffer_.col(c).allFinite(); };
  const bool orbit = full_power_.size() > 0, lead = orbit ? whole(orbit_.first) && whole(orbit_.second) : whole(0);
  if (!lead) {
    ++skipped_;
    return;
  }
  const SpectrumOptions options{.window = settings_.window, .kind = AmplitudeKind::peak};
  const bool full = settings_.averaging == Averaging::linear && count_ >= settings_.averages;
  if (!full) ++count_;
  latest_ = Eigen::MatrixXd::Zero(power_.rows(), power_.cols());
  for (Index c = 0; c < buffer_.cols(); ++c) {
    if (!whole(c)) continue;
    latest_.col(c) = amplitude_spectrum(buffer_.col(c), 1 / rate_, options).amplitude;
    if (!full) take(static_cast<std::size_t>(c), power_.col(c), latest_.col(c).cwiseAbs2());
  }
  if (orbit && !full) {
    const AmplitudeSpectrum both = full_spectrum(buffer_.col(orbit_.first), buffer_.col(orbit_.second), 1 / rate_, options);
    // Of an even number of lines the lowest, half the rate, is neither forward nor backward.
    take(counts_.size() - 1, full_power_, both.amplitude.tail(full_power_.size()).cwiseAbs2());
  }
}

void SpectrumAverage::take(std::size_t index, Eigen::Ref<Eigen::VectorXd> average, const Eigen::Ref<const Eigen::VectorXd>& power) {
  const long count = ++counts_[index];
  if (settings_.averaging == Averaging::peak_hold) {
    average = average.cwiseMax(power);
  } else {
    average += (power - average) / static_cast<double>(std::min<long>(count, settings_.averages));
  }
}

}  // namespace whirl::monitor
