#include "whirl/signal/motion_quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/fft.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::signal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Complex = std::complex<double>;
constexpr double kBlockPeriods = 40;  // of the lowest frequency: the Hann line is then a twentieth of it wide
constexpr double kLeastPeriods = 10;

/// Derivatives of the displacement; nothing for what is no motion.
std::optional<int> derivative_of_displacement(Quantity q) {
  if (q == Quantity::displacement) return 0;
  if (q == Quantity::velocity) return 1;
  if (q == Quantity::acceleration) return 2;
  return std::nullopt;
}

double band_gain(double f, const Band& band) {
  const double from = 0.5 * band.low, to = 1.1 * band.high;
  if (f <= from || f >= to) return 0;
  if (f < band.low) return 0.5 - 0.5 * std::cos(std::numbers::pi * (f - from) / (band.low - from));
  if (f > band.high) return 0.5 + 0.5 * std::cos(std::numbers::pi * (f - band.high) / (to - band.high));
  return 1;
}

/// x without the line through the means of its first and last `part` samples, continued at either side by its negative
/// image: slow motion goes on without a step, which the integration would turn into a long transient.
VectorXd continued(const Eigen::Ref<const VectorXd>& x, Index part, Index side) {
  const Index n = x.size();
  const double slope = (x.tail(part).mean() - x.head(part).mean()) / static_cast<double>(std::max<Index>(1, n - part));
  const VectorXd rise = VectorXd::LinSpaced(n, 0, slope * static_cast<double>(n - 1));
  VectorXd level = x - rise;
  level.array() -= level.mean();
  VectorXd out(n + 2 * side);
  out << -level.segment(1, side).reverse(), level, -level.segment(n - 1 - side, side).reverse();
  return out;
}

}  // namespace

double factor_from_peak(AmplitudeKind kind) {
  switch (kind) {
    case AmplitudeKind::peak:
      return 1;
    case AmplitudeKind::peak_to_peak:
      return 2;
    case AmplitudeKind::rms:
      return 1 / std::numbers::sqrt2;
  }
  return 1;
}

std::optional<int> integrations(Quantity from, Quantity to) {
  const auto a = derivative_of_displacement(from), b = derivative_of_displacement(to);
  if (!a || !b) return std::nullopt;
  return *a - *b;
}

VectorXd integrated(const Eigen::Ref<const VectorXd>& x, double dt, int times, const Band& band) {
  if (!(band.low > 0 && band.high > band.low))
    throw Error(fmt::format("band from {:g} to {:g} Hz: must rise from above zero", band.low, band.high));
  const Index n = x.size();
  if (static_cast<double>(n) * dt * band.low < 2)
    throw Error(fmt::format("record of {:g} s: an integration from {:g} Hz on needs two periods, {:g} s",
                            static_cast<double>(n) * dt, band.low, 2 / band.low));
  const auto period = static_cast<Index>(std::ceil(1 / (band.low * dt)));
  const Index side = std::min<Index>(n - 1, 4 * period);
  const VectorXd all = continued(x, std::min(period, n / 2), side);
  const Index length = fast_fft_length(all.size());
  Eigen::VectorXcd lines = Eigen::VectorXcd::Zero(length);
  lines.head(all.size()).real() = all;
  lines = fft(lines);
  for (Index k = 0; k < length; ++k) {
    const double f = static_cast<double>(2 * k > length ? k - length : k) / (static_cast<double>(length) * dt);
    const double gain = f == 0 ? 0 : band_gain(std::abs(f), band);
    lines[k] *= gain == 0 ? Complex(0) : gain * std::pow(Complex(0, kTwoPi * f), -times);
  }
  return inverse_fft(lines).real().segment(side, n);
}

SynchronousCurve in_quantity(SynchronousCurve curve, Quantity quantity) {
  const auto times = integrations(curve.quantity, quantity);
  if (!times)
    throw Error(
        fmt::format("{}: {} cannot be shown as {}", curve.name, to_string(curve.quantity), to_string(quantity)));
  for (Index i = 0; i < curve.vector.size(); ++i)
    curve.vector[i] *= std::pow(Complex(0, curve.order * curve.speed[i]), -*times);
  curve.quantity = quantity;
  return curve;
}

std::optional<BandLevel> band_level(const Eigen::Ref<const VectorXd>& x, double dt, int times, const Band& band) {
  const Index n = x.size();
  BandLevel out;
  out.low = band.low;
  out.high = std::min(band.high, 0.5 / dt);
  const Index size = std::min(n, static_cast<Index>(std::lround(kBlockPeriods / (band.low * dt))));
  out.block = static_cast<double>(size) * dt;
  if (out.block * band.low < kLeastPeriods || out.high < 1.25 * band.low) return std::nullopt;
  double within = 0, below = 0;
  const SpectrumOptions options{.window = Window::hann, .kind = AmplitudeKind::rms};
  for (Index first = 0; first + size <= n; first += std::max<Index>(1, size / 2)) {
    const VectorXd part = x.segment(first, size);
    if (!part.allFinite()) continue;
    const AmplitudeSpectrum s = amplitude_spectrum(part.array() - part.mean(), dt, options);
    // A Hann line gathers what lies within its noise bandwidth.
    const double share = s.frequency[1] / s.noise_bandwidth;
    double in = 0;
    for (Index k = 1; k < s.frequency.size() && s.frequency[k] <= out.high; ++k) {
      const double power = share * std::norm(s.amplitude[k] * std::pow(kTwoPi * s.frequency[k], -times));
      (s.frequency[k] < band.low ? below : in) += power;
    }
    within += in;
    out.largest = std::max(out.largest, std::sqrt(in));
    ++out.blocks;
  }
  if (out.blocks == 0) return std::nullopt;
  out.rms = std::sqrt(within / static_cast<double>(out.blocks));
  out.below = std::sqrt(below / static_cast<double>(out.blocks));
  return out;
}

}  // namespace whirl::signal
