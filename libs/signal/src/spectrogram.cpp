#include "whirl/signal/spectrogram.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::signal {
namespace {

using Eigen::Index;

// `spectrum(first)` gives the spectrum of the block that begins at sample `first`.
template <class F>
Spectrogram collect(Index samples, double dt, Index block, Index columns, F&& spectrum) {
  require_range("columns", static_cast<double>(columns), 1, 1e6);
  require_range("block", static_cast<double>(block), 1, static_cast<double>(samples), "samples");
  const Index last = samples - block;
  columns = std::min(columns, last + 1);
  Spectrogram out;
  out.time.resize(columns);
  for (Index j = 0; j < columns; ++j) {
    const Index first = columns == 1 ? 0 : last * j / (columns - 1);
    const AmplitudeSpectrum s = spectrum(first);
    if (j == 0) {
      out.frequency = s.frequency;
      out.kind = s.kind;
      out.noise_bandwidth = s.noise_bandwidth;
      out.amplitude.resize(s.amplitude.size(), columns);
    }
    out.amplitude.col(j) = s.amplitude;
    out.time[j] = (static_cast<double>(first) + 0.5 * static_cast<double>(block)) * dt;
  }
  return out;
}

}  // namespace

Spectrogram spectrogram(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, const SpectrumOptions& options,
                        Index columns) {
  SpectrumOptions one = options;
  one.block = 0;
  return collect(x.size(), dt, options.block, columns,
                 [&](Index first) { return amplitude_spectrum(x.segment(first, options.block), dt, one); });
}

Spectrogram full_spectrogram(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
                             double dt, const SpectrumOptions& options, Index columns) {
  if (x.size() != y.size()) throw Error("orbit with x and y of different length: must be equally many samples");
  SpectrumOptions one = options;
  one.block = 0;
  return collect(x.size(), dt, options.block, columns, [&](Index first) {
    return full_spectrum(x.segment(first, options.block), y.segment(first, options.block), dt, one);
  });
}

Index sweep_block(double rate, double dt, Index samples) {
  require_range("dt", dt, 1e-15, 1e6, "s");
  const Index most = std::max<Index>(1, samples / 4);
  if (!(rate > 0)) return most;
  const auto block = static_cast<Index>(std::min(std::sqrt(1 / rate) / dt, static_cast<double>(most)));
  return std::clamp(fast_fft_length(block), std::min<Index>(64, most), most);
}

}  // namespace whirl::signal
