#include "record/record_maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/spectrogram.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Speed at times from the start of the record; standstill is 0.
VectorXd speed_at(const VectorXd& time, const diagnosis::Rotation& turning, double dt) {
  return time.unaryExpr([&](double t) {
    const auto i = static_cast<Index>(std::lround(t / dt)) - turning.first;
    return i < 0 || i >= turning.size() ? 0.0 : turning.speed[i];
  });
}

// The spectra in `bins` equal steps of speed: of each step the largest amplitudes, and where none falls into it those
// of the nearest step.
Eigen::MatrixXd over_speed(const signal::Spectrogram& map, const VectorXd& speed, double low, double high, Index bins) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Constant(map.amplitude.rows(), bins, NAN);
  for (Index j = 0; j < speed.size(); ++j) {
    const double place = (speed[j] - low) / (high - low) * static_cast<double>(bins - 1);
    if (!(place >= -0.5 && place <= static_cast<double>(bins) - 0.5)) continue;
    const Index bin = std::lround(place);
    for (Index i = 0; i < out.rows(); ++i) out(i, bin) = std::fmax(out(i, bin), map.amplitude(i, j));
  }
  std::vector<Index> filled;
  for (Index b = 0; b < bins; ++b) {
    if (!std::isnan(out(0, b))) filled.push_back(b);
  }
  for (Index b = 0; b < bins && !filled.empty(); ++b) {
    if (!std::isnan(out(0, b))) continue;
    out.col(b) = out.col(*std::ranges::min_element(filled, {}, [&](Index f) { return std::abs(f - b); }));
  }
  return out;
}

signal::Spectrogram spectra_of(const Recording& r, const std::optional<diagnosis::Rotation>& turning, bool full,
                               const std::string& channel, double highest, const signal::SpectrumOptions& s,
                               Index columns) {
  // A mean position or an offset is no vibration.
  const auto motion = [&](const std::string& name) -> VectorXd { return r[name].array() - r[name].mean(); };
  if (turning && turning->angle[turning->size() - 1] - turning->angle[0] > 8 * kTwoPi) {
    const auto part = [&](const std::string& name) -> VectorXd {
      return motion(name).segment(turning->first, turning->size());
    };
    const VectorXd y = full ? part("y") : VectorXd();
    signal::Spectrogram map = signal::turning_spectrogram(part(full ? "x" : channel), full ? &y : nullptr,
                                                          turning->angle, r.dt, highest, s, columns);
    map.time.array() += r.dt * static_cast<double>(turning->first);
    return map;
  }
  return full ? signal::full_spectrogram(motion("x"), motion("y"), r.dt, s, columns)
              : signal::spectrogram(motion(channel), r.dt, s, columns);
}

}  // namespace

std::string_view window_name(signal::Window window) {
  return window == signal::Window::hann ? "Hann" : window == signal::Window::flat_top ? "flat-top" : "rectangular";
}

std::optional<diagnosis::Rotation> readable_rotation(const Recording& record) {
  try {
    return diagnosis::rotation_of(record);
  } catch (const Error&) {
    return std::nullopt;
  }
}

diagnosis::Rotation required_rotation(const Recording& record) {
  if (auto turning = diagnosis::rotation_of(record)) return *std::move(turning);
  throw Error(fmt::format(
      "{}: no rotor angle: needs a channel beta (rad) or pulses (key, keyphasor, tacho) over two turns or more",
      record.source));
}

report::Figure map_view(const std::string& what, const Recording& r, const std::string& channel, const ViewOptions& o) {
  const bool over_rpm = what == "cascade" || what == "run-map", full = what == "full-waterfall";
  std::optional<diagnosis::Rotation> turning = diagnosis::rotation_of(r);
  if (over_rpm && !turning) turning = required_rotation(r);

  signal::SpectrumOptions s;
  // Against the rotor angle an order lies on a line of the block, where every window shows its amplitude.
  s.window = o.window.value_or(turning ? signal::Window::hann : signal::Window::flat_top);
  s.kind = o.scale.kind;
  const double sweep = turning ? turning->sweep_rate(r.dt) / kTwoPi : 0;
  s.block = o.resolution > 0 ? std::lround(r.rate() / o.resolution)
            // Half of what the sweep lets pass, for the amplitude of a fast passage.
            : turning ? signal::sweep_block(2 * sweep, r.dt, r.size())
                      : std::max<Index>(std::min<Index>(64, r.size()), r.size() / 40);
  s.block = std::clamp<Index>(s.block, 1, r.size());
  const Index columns = what == "cascade" ? 60 : 240;
  const double highest = o.highest_frequency > 0 ? o.highest_frequency
                         : turning               ? std::min(0.5 * r.rate(), 4 * turning->highest_speed() / kTwoPi)
                                                 : 0.5 * r.rate();
  signal::Spectrogram map = spectra_of(r, turning, full, channel, highest, s, columns);
  Index from = 0, rows = map.frequency.size();
  while (from < rows && map.frequency[from] < -highest) ++from;
  while (rows > from + 1 && map.frequency[rows - 1] > highest) --rows;
  map.frequency = map.frequency.segment(from, rows - from).eval();
  map.amplitude = map.amplitude.middleRows(from, rows - from).eval();
  const double low = map.frequency[0], high = map.frequency[map.frequency.size() - 1];

  const VectorXd speed = turning ? speed_at(map.time, *turning, r.dt) : VectorXd();
  const Quantity quantity = r.at(full ? "x" : channel).quantity;
  report::Figure figure;
  if (over_rpm) {
    const double slowest = turning->speed.minCoeff(), fastest = turning->highest_speed();
    const Index bins = what == "cascade" ? 40 : 160;
    const Eigen::MatrixXd amplitude = over_speed(map, speed, slowest, fastest, bins);
    figure =
        what == "cascade"
            ? report::cascade(VectorXd::LinSpaced(bins, slowest, fastest), map.frequency, amplitude, o.scale, quantity)
            : report::run_map(slowest, fastest, high, amplitude, o.scale, o.natural_frequencies, quantity);
  } else {
    figure = report::waterfall(r.t0 + map.time[0], r.t0 + map.time[map.time.size() - 1], high, map.amplitude, o.scale,
                               speed, full ? low : 0, quantity);
    for (const double f : o.natural_frequencies) {
      figure.panels.front().horizontal(f, report::format_number(f, 4) + " Hz",
                                       {.color = 3, .width = 1, .dash = report::Dash::dotted});
    }
  }
  figure.panels.front().title =
      fmt::format("{}: {} window, noise bandwidth {:.3g} Hz{}", full ? "x + i y" : channel, window_name(s.window),
                  map.noise_bandwidth, turning && sweep > 1e-3 ? fmt::format(", sweep {:.3g} Hz/s", sweep) : "");
  return figure;
}

}  // namespace whirl::pages
