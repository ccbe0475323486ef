#include "whirl/signal/spectrogram.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/fft.hpp"
#include "whirl/signal/order.hpp"

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

// Lines onto a uniform grid: a cell shows its largest line, so that no peak is lost, and without one the way between
// its neighbours.
Eigen::VectorXd on_grid(const AmplitudeSpectrum& s, const Eigen::VectorXd& grid) {
  const double cell = grid[1] - grid[0], line = s.frequency[1] - s.frequency[0];
  Eigen::VectorXd out(grid.size());
  for (Index i = 0; i < grid.size(); ++i) {
    const double place = (grid[i] - s.frequency[0]) / line, half = 0.5 * cell / line;
    const auto first = static_cast<Index>(std::ceil(place - half)), last = static_cast<Index>(std::floor(place + half));
    if (place < 0 || place > static_cast<double>(s.frequency.size() - 1)) {
      out[i] = NAN;
    } else if (first <= last) {
      const Index from = std::max<Index>(first, 0), to = std::min(last, s.amplitude.size() - 1);
      out[i] = from <= to ? s.amplitude.segment(from, to - from + 1).maxCoeff() : NAN;
    } else {
      const auto below = static_cast<Index>(place);
      out[i] =
          s.amplitude[below] + (place - static_cast<double>(below)) * (s.amplitude[below + 1] - s.amplitude[below]);
    }
  }
  return out;
}

}  // namespace

Spectrogram turning_spectrogram(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::VectorXd* y,
                                const Eigen::Ref<const Eigen::VectorXd>& angle, double dt, double highest,
                                const SpectrumOptions& options, Index columns) {
  constexpr Index kLeastTurns = 4;
  require_range("highest", highest, 1e-9, 0.5 / dt, "Hz");
  const double block_time = dt * static_cast<double>(options.block);
  const double slowest = (angle[angle.size() - 1] - angle[0]) / kTwoPi / (dt * static_cast<double>(angle.size())) / 8;
  const int per_turn = static_cast<int>(std::clamp(std::ceil(2.2 * highest / slowest), 16.0, 512.0));
  const AngularSignal ax = resample_in_angle(x, angle, dt, per_turn);
  AngularSignal ay;
  if (y != nullptr) ay = resample_in_angle(*y, angle, dt, per_turn);
  const Index turns = ax.turns();
  if (turns < kLeastTurns)
    throw Error(fmt::format("record of {} turns: a spectrum needs {} or more", turns, kLeastTurns));
  SpectrumOptions one = options;
  one.block = 0;
  Spectrogram out;
  const double step = 0.5 / block_time;
  const auto lines = std::max<Index>(2, static_cast<Index>(highest / step));
  out.frequency = Eigen::VectorXd::LinSpaced(y != nullptr ? 2 * lines + 1 : lines + 1,
                                             y != nullptr ? -step * static_cast<double>(lines) : 0,
                                             step * static_cast<double>(lines));
  columns = std::min(columns, turns - kLeastTurns + 1);
  out.time.resize(columns);
  out.amplitude.resize(out.frequency.size(), columns);
  const double first_time = ax.time[0], last_time = ax.time[ax.time.size() - 1];
  Index used = 0;
  for (Index j = 0; j < columns; ++j) {
    const double t =
        first_time + (last_time - first_time) * (static_cast<double>(j) + 0.5) / static_cast<double>(columns);
    const Index at = std::lower_bound(ax.time.data(), ax.time.data() + ax.time.size() - 1, t) - ax.time.data();
    const Index before = std::max<Index>(0, at - per_turn), after = std::min(ax.time.size() - 1, at + per_turn);
    const double turn_time = (ax.time[after] - ax.time[before]) / static_cast<double>(after - before) * per_turn;
    const Index held = std::clamp<Index>(std::lround(block_time / turn_time), kLeastTurns, turns);
    const Index size = held * per_turn;
    Index first = at - size / 2;
    // A block that does not fit is left out, unless none would be left.
    if (first < 0 || first + size > ax.samples.size()) {
      if (used > 0 || j + 1 < columns) continue;
      first = std::clamp<Index>(first, 0, ax.samples.size() - size);
    }
    const double lasts = ax.time[std::min(first + size, ax.time.size() - 1)] - ax.time[first];
    const double sample = lasts / static_cast<double>(size);
    const AmplitudeSpectrum s =
        y != nullptr ? full_spectrum(ax.samples.segment(first, size), ay.samples.segment(first, size), sample, one)
                     : amplitude_spectrum(ax.samples.segment(first, size), sample, one);
    out.amplitude.col(used) = on_grid(s, out.frequency);
    out.time[used] = t;
    out.kind = s.kind;
    out.noise_bandwidth = s.noise_bandwidth * lasts / block_time;
    ++used;
  }
  out.time.conservativeResize(used);
  out.amplitude.conservativeResize(Eigen::NoChange, used);
  return out;
}

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
