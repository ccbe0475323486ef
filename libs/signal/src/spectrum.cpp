#include "whirl/signal/spectrum.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/signal/fft.hpp"
#include "whirl/signal/motion_quantity.hpp"

namespace whirl::signal {

namespace {

Eigen::Index checked_block(Eigen::Index n, double dt, const SpectrumOptions& options) {
  require_range("dt", dt, 1e-15, 1e15, "s");
  require_range("overlap", options.overlap, 0, 0.95);
  if (n < 1) throw Error("spectrum of an empty signal: must have at least one sample");
  if (options.block < 0 || options.block > n) {
    throw Error(fmt::format("block = {}: must be between 0 and the {} samples of the signal", options.block, n));
  }
  return options.block == 0 ? n : options.block;
}

// Calls f(first sample) for every whole block; returns their number.
long each_block(Eigen::Index n, Eigen::Index block, double overlap, const std::function<void(Eigen::Index)>& f) {
  const auto step =
      std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::lround(static_cast<double>(block) * (1 - overlap))));
  long count = 0;
  for (Eigen::Index first = 0; first + block <= n; first += step, ++count) f(first);
  return count;
}

// Mean squared magnitude of the one-sided transforms of the windowed blocks.
long mean_square_lines(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::VectorXd& w, double overlap,
                       Eigen::VectorXd& mean_square) {
  const Eigen::Index block = w.size();
  mean_square = Eigen::VectorXd::Zero(block / 2 + 1);
  const long count = each_block(x.size(), block, overlap, [&](Eigen::Index first) {
    const Eigen::VectorXcd lines = real_fft(x.segment(first, block).cwiseProduct(w));
    mean_square += lines.cwiseAbs2();
  });
  mean_square /= static_cast<double>(count);
  return count;
}

Eigen::VectorXd line_frequencies(Eigen::Index lines, Eigen::Index block, double dt) {
  return Eigen::VectorXd::LinSpaced(lines, 0, static_cast<double>(lines - 1)) / (static_cast<double>(block) * dt);
}

bool is_nyquist(Eigen::Index line, Eigen::Index block) { return 2 * line == block; }

}  // namespace

AmplitudeSpectrum amplitude_spectrum(const Eigen::Ref<const Eigen::VectorXd>& x, double dt,
                                     const SpectrumOptions& options) {
  const Eigen::Index block = checked_block(x.size(), dt, options);
  const Eigen::VectorXd w = window(options.window, block);
  Eigen::VectorXd mean_square;
  mean_square_lines(x, w, options.overlap, mean_square);
  AmplitudeSpectrum result;
  result.kind = options.kind;
  result.frequency = line_frequencies(mean_square.size(), block, dt);
  result.noise_bandwidth = noise_bandwidth(w) / (static_cast<double>(block) * dt);
  result.amplitude = mean_square.cwiseSqrt() / w.sum();
  for (Eigen::Index i = 1; i < result.amplitude.size(); ++i) {
    // A line between 0 and Nyquist carries half of a sine; its other half is at the negative frequency.
    result.amplitude[i] *= (is_nyquist(i, block) ? 1 : 2) * factor_from_peak(options.kind);
  }
  return result;
}

AmplitudeSpectrum full_spectrum(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
                                double dt, const SpectrumOptions& options) {
  if (x.size() != y.size()) {
    throw Error(fmt::format("orbit with {} samples in x and {} in y: must be equally many", x.size(), y.size()));
  }
  const Eigen::Index block = checked_block(x.size(), dt, options);
  const Eigen::VectorXd w = window(options.window, block);
  Eigen::VectorXcd z(x.size());
  z.real() = x;
  z.imag() = y;
  Eigen::VectorXd mean_square = Eigen::VectorXd::Zero(block);
  const long count = each_block(z.size(), block, options.overlap, [&](Eigen::Index first) {
    const Eigen::VectorXcd lines = fft(z.segment(first, block).cwiseProduct(w));
    mean_square += lines.cwiseAbs2();
  });
  AmplitudeSpectrum result;
  result.kind = options.kind;
  result.noise_bandwidth = noise_bandwidth(w) / (static_cast<double>(block) * dt);
  result.frequency.resize(block);
  result.amplitude.resize(block);
  const Eigen::Index negative = block / 2;  // lines -block/2 .. (block - 1)/2, ascending
  for (Eigen::Index i = 0; i < block; ++i) {
    const Eigen::Index line = i - negative;
    const Eigen::Index k = line < 0 ? line + block : line;
    result.frequency[i] = static_cast<double>(line) / (static_cast<double>(block) * dt);
    result.amplitude[i] = std::sqrt(mean_square[k] / static_cast<double>(count)) / w.sum() *
                          (line == 0 ? 1 : factor_from_peak(options.kind));
  }
  return result;
}

}  // namespace whirl::signal
