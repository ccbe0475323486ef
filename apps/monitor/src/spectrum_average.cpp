#include "whirl/monitor/spectrum_average.hpp"

#include <algorithm>

#include "whirl/core/error.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::monitor {

using Eigen::Index;

SpectrumAverage::SpectrumAverage(Index channels, double rate, const SpectrumSettings& settings)
    : rate_(rate), settings_(settings) {
  require_range("block", static_cast<double>(settings.block), 64, 65536, "samples");
  require_range("overlap", settings.overlap, 0, 0.9);
  require_range("averages", settings.averages, 1, 1000);
  buffer_.resize(settings.block, channels);
  reset();
}

void SpectrumAverage::reset() {
  filled_ = 0;
  count_ = skipped_ = 0;
  power_ = Eigen::MatrixXd::Zero(settings_.block / 2 + 1, buffer_.cols());
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
  if (!buffer_.allFinite()) {
    ++skipped_;
    return;
  }
  if (settings_.averaging == Averaging::linear && count_ >= settings_.averages) return;
  ++count_;
  for (Index c = 0; c < buffer_.cols(); ++c) {
    const AmplitudeSpectrum spectrum =
        amplitude_spectrum(buffer_.col(c), 1 / rate_, {.window = settings_.window, .kind = AmplitudeKind::peak});
    const Eigen::VectorXd power = spectrum.amplitude.cwiseAbs2();
    if (settings_.averaging == Averaging::peak_hold) {
      power_.col(c) = power_.col(c).cwiseMax(power);
    } else {
      power_.col(c) += (power - power_.col(c)) / static_cast<double>(std::min<long>(count_, settings_.averages));
    }
  }
}

}  // namespace whirl::monitor
