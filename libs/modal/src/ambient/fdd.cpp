#include "whirl/modal/fdd.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tones.hpp"
#include "usable_record.hpp"
#include "wandering_tones.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/modal/poles.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;

// Frequency and damping from the bell around a peak: its inverse transform is an autocorrelation exp(p |tau|).
void fit_bell(const Eigen::VectorXd& bell, Index first, Index block, double line, const Eigen::VectorXd& lag_window,
              AmbientMode& mode) {
  const Index m = signal::fast_fft_length(block);
  Eigen::VectorXcd spectrum = Eigen::VectorXcd::Zero(m);
  spectrum.head(bell.size()) = bell.cast<Complex>();
  const Eigen::VectorXcd r = signal::inverse_fft(spectrum);  // shifted to 0 Hz: the phase turns with f - first * line
  const double step = 1 / (static_cast<double>(m) * line);
  // Straight lines through log|r| and arg r, from 0.9 to 0.2 of the start.
  double n = 0, st = 0, stt = 0, sl = 0, stl = 0, sp = 0, stp = 0, phase = 0;
  const double sample = 1 / (static_cast<double>(block) * line);
  for (Index k = 1; k < m / 2; ++k) {
    const double tau = static_cast<double>(k) * step, lag = tau / sample;
    const Index at = static_cast<Index>(lag);
    if (at + 1 >= lag_window.size() || lag_window[at] < 0.1 * lag_window[0]) break;
    const Complex turn = r[k] / r[k - 1];
    phase += std::arg(turn);
    const double window = lag_window[at] + (lag - static_cast<double>(at)) * (lag_window[at + 1] - lag_window[at]);
    const double size = std::abs(r[k]) / std::abs(r[0]) * lag_window[0] / window;
    if (size > 0.9) continue;
    if (size < 0.2) break;
    n += 1, st += tau, stt += tau * tau, sl += std::log(size), stl += tau * std::log(size), sp += phase,
        stp += tau * phase;
  }
  const double spread = n * stt - st * st;
  if (n < 4 || !(spread > 0)) return;
  const double decay = -(n * stl - st * sl) / spread,
               omega = (n * stp - st * sp) / spread + 2 * kPi * line * static_cast<double>(first);
  if (!(decay > 0) || !(omega > 0)) return;
  mode.frequency = std::hypot(omega, decay) / (2 * kPi);
  mode.damping = decay / std::hypot(omega, decay);
}

/// Samples of one block. Throws Error unless the channels show one quantity and the record holds four blocks.
Index block_of(const Recording& recording, const FddOptions& options) {
  for (const Channel& c : recording.channels) {
    if (c.quantity != recording.channels.front().quantity) {
      throw Error(fmt::format("{}: channel '{}' shows {}, the first {}: must be one quantity", recording.source, c.name,
                              to_string(c.quantity), to_string(recording.channels.front().quantity)));
    }
  }
  const Index block = 2 * (options.line > 0 ? static_cast<Index>(std::lround(recording.rate() / options.line / 2))
                                            : recording.size() / 65);
  if (block < 64 || block > recording.size() / 4) {
    throw Error(fmt::format("{}: blocks of {} samples in a record of {}: must be 64 to a quarter of it",
                            recording.source, block, recording.size()));
  }
  return block;
}

/// Sums of the cross spectra over half-overlapping blocks, one matrix per line; returns their number.
long sum_spectra(const Recording& recording, const Eigen::VectorXd& window, std::vector<Eigen::MatrixXcd>& spectra) {
  const Index block = window.size(), lines = block / 2 + 1;
  const auto channels = static_cast<Index>(recording.channels.size());
  spectra.assign(static_cast<std::size_t>(lines), Eigen::MatrixXcd::Zero(channels, channels));
  long averages = 0;
  Eigen::MatrixXcd transforms(lines, channels);
  for (Index first = 0; first + block <= recording.size(); first += block / 2, ++averages) {
    for (Index c = 0; c < channels; ++c) {
      const Eigen::VectorXd part = recording.channels[static_cast<std::size_t>(c)].samples.segment(first, block);
      transforms.col(c) = signal::real_fft((part.array() - part.mean()).matrix().cwiseProduct(window));
    }
    for (Index k = 0; k < lines; ++k)
      spectra[static_cast<std::size_t>(k)] += transforms.row(k).transpose() * transforms.row(k).conjugate();
  }
  return averages;
}

/// The record without its tones, each a warning. A tone is a peak of one line, whose bell would be that of the window.
Recording without_tones(Recording recording, double low, double high, Summary& summary) {
  const auto channels = static_cast<Index>(recording.channels.size());
  Eigen::MatrixXd y(recording.size(), channels);
  for (Index c = 0; c < channels; ++c) {
    const Eigen::VectorXd& samples = recording.channels[static_cast<std::size_t>(c)].samples;
    y.col(c) = samples.array() - samples.mean();
  }
  std::vector<Tone> tones = take_off_wandering_tones(y, recording.dt, low, high);
  for (Tone& tone : find_tones(y, recording.dt, low, high)) {
    subtract_tone(y, recording.dt, tone);
    tones.push_back(std::move(tone));
  }
  for (const Tone& tone : tones)
    summary.warn(fmt::format("{:.5g} Hz is a tone, not a mode: {}", tone.frequency, tone.evidence));
  for (Index c = 0; c < channels; ++c) recording.channels[static_cast<std::size_t>(c)].samples = y.col(c);
  return recording;
}

/// Share of the peak at line k over the walk down to either side before anything higher.
double prominence(const Eigen::VectorXd& first, Index k) {
  double left = first[k], right = first[k];
  for (Index i = k - 1; i >= 1 && first[i] <= first[k]; --i) left = std::min(left, first[i]);
  for (Index i = k + 1; i < first.size() && first[i] <= first[k]; ++i) right = std::min(right, first[i]);
  return first[k] / std::max(left, right);
}

}  // namespace

AmbientModes decompose_ambient(const Recording& given, const FddOptions& options) {
  given.check();
  AmbientModes result;
  Recording recording = usable_record(given, result.summary);
  const Index block = block_of(recording, options);
  const double high = options.band_high > 0 ? options.band_high : 0.4 * recording.rate();
  recording = without_tones(std::move(recording), options.band_low, high, result.summary);
  const auto channels = static_cast<Index>(recording.channels.size());
  for (const Channel& c : recording.channels) result.channels.push_back(c.name);
  Eigen::VectorXd window(block), lag_window = Eigen::VectorXd::Zero(block);
  for (Index i = 0; i < block; ++i)
    window[i] = 0.5 - 0.5 * std::cos(2 * kPi * (static_cast<double>(i) + 0.5) / static_cast<double>(block));
  for (Index lag = 0; lag < block; ++lag) lag_window[lag] = window.head(block - lag).dot(window.tail(block - lag));

  const Index lines = block / 2 + 1;
  const double line = recording.rate() / static_cast<double>(block);
  std::vector<Eigen::MatrixXcd> spectra;
  const long averages = sum_spectra(recording, window, spectra);
  const double scale = 2 / (window.squaredNorm() * recording.rate() * static_cast<double>(averages));
  result.frequency = Eigen::VectorXd::LinSpaced(lines, 0, static_cast<double>(lines - 1)) * line;
  result.singular_values.resize(lines, channels);
  Eigen::MatrixXcd vectors(channels, lines);
  for (Index k = 0; k < lines; ++k) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd> eigen(
        Eigen::MatrixXcd(spectra[static_cast<std::size_t>(k)] * scale));
    result.singular_values.row(k) = eigen.eigenvalues().reverse().cwiseMax(0).transpose();
    vectors.col(k) = eigen.eigenvectors().col(channels - 1);
  }

  const Eigen::VectorXd first = result.singular_values.col(0);
  const Index low_line = std::max<Index>(3, static_cast<Index>(std::ceil(options.band_low / line)));
  const Index high_line = std::min(lines - 4, static_cast<Index>(high / line));
  const double factor = std::pow(10, options.prominence / 10);
  for (Index k = low_line; k <= high_line; ++k) {
    if (first[k] < first.segment(k - 3, 7).maxCoeff()) continue;
    if (prominence(first, k) < factor) continue;
    AmbientMode mode;
    mode.frequency = result.frequency[k];
    mode.damping = NAN;
    Index largest = 0;
    vectors.col(k).cwiseAbs().maxCoeff(&largest);
    mode.shape = vectors.col(k) / vectors(largest, k);
    const auto belongs = [&](Index i) {
      return mac(vectors.col(i), vectors.col(k)) >= options.least_mac && first[i] > 0.002 * first[k];
    };
    Index begin = k, end = k;
    while (begin > 1 && belongs(begin - 1)) --begin;
    while (end + 1 < lines && belongs(end + 1)) ++end;
    if (end - begin >= 4) fit_bell(first.segment(begin, end - begin + 1), begin, block, line, lag_window, mode);
    result.modes.push_back(std::move(mode));
  }
  if (result.modes.empty()) result.summary.fail("no peak rises above the spectra");
  result.summary.trust = fmt::format("{} from {} of {:.4g} s, lines of {:.3g} Hz; the excitation is taken as white",
                                     counted(result.modes.size(), "mode"), counted(averages, "block"),
                                     static_cast<double>(block) * recording.dt, line);
  for (const AmbientMode& mode : result.modes) {
    if (2 * mode.damping * mode.frequency < line) {
      result.summary.warn(fmt::format(
          "mode at {:.5g} Hz is narrower than a line of {:.3g} Hz: its damping is uncertain; set a finer line",
          mode.frequency, line));
    }
  }
  return result;
}

}  // namespace whirl::modal
