// Tones whose frequency wanders, found and followed without a tacho.
//
// Found: bands in which the record stands out of the lines beside them are projected on the direction that stands out
// most; random response there has an envelope whose square is exponentially distributed, a tone a steady one.
// Followed: a Kalman smoother tracks the phase; related orders (m/n times the tone) show as single lines once the phase
// is turned back, and all of them then refine the phase together.
#include "wandering_tones.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "phase_track.hpp"
#include "shaft_orders.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr double kWidest = 0.03;    // half width of a tone's band over its frequency: 1 % sd and a tail
constexpr double kStandsOut = 3;    // power in the band over that beside it, from which a band is looked at
constexpr double kSteady = -14;     // logarithm of the chance below which an envelope is taken for a tone's
constexpr double kOrderShown = -9;  // the same for a line of the turned-back record; some 60 are looked at
constexpr int kMostShafts = 8;

struct SteadyBand {
  Index centre = 0, half = 0;  // lines
  VectorXcd direction;         // of the channels: envelope = direction^H lines
  double chance = 0;           // logarithm
};

/// Logarithm of the chance that the squared envelope of random response varies so little. n exponential variables share
/// their sum evenly over a simplex; those of a squared coefficient of variation below v lie in a ball of radius
/// sqrt(v/n) about its centre, whose part of the simplex is an upper bound (Greenwood's statistic, 1946).
double steady_chance(const VectorXcd& lines) {
  const VectorXd power = lines.cwiseAbs2();
  const double n = 2 * std::pow(power.sum(), 2) / power.squaredNorm();  // 2: lines of a random record scatter as much
  VectorXcd padded = VectorXcd::Zero(signal::fast_fft_length(3 * lines.size()));
  padded.head(lines.size()) = lines;
  const VectorXd square = signal::inverse_fft(padded).cwiseAbs2();
  const double v = (square.array() - square.mean()).square().mean() / std::pow(square.mean(), 2);
  if (n < 3) return 0;
  const double log_r = 0.5 * std::log(v / n);
  return std::min(0.0, 0.5 * (n - 1) * std::log(kPi) - std::lgamma(0.5 * (n + 1)) + (n - 1) * log_r + std::lgamma(n) -
                           0.5 * std::log(n));
}

MatrixXcd covariance_of_lines(const MatrixXcd& lines, Index first, Index count) {
  const Index from = std::max<Index>(1, first), to = std::min(lines.rows(), first + count);
  if (to <= from) return MatrixXcd::Zero(lines.cols(), lines.cols());
  return lines.middleRows(from, to - from).transpose() * lines.middleRows(from, to - from).conjugate();
}

/// The band about a line, seen in the direction that stands out most of the lines beside it.
SteadyBand look_at(const RecordSpectra& spectra, Index centre, Index half) {
  const Index beside = std::max<Index>(2 * half, 12), gap = half / 2 + 2;
  const MatrixXcd in = covariance_of_lines(spectra.lines, centre - half, 2 * half + 1);
  MatrixXcd out = covariance_of_lines(spectra.lines, centre - half - gap - beside, beside) +
                  covariance_of_lines(spectra.lines, centre + half + gap + 1, beside);
  out.diagonal().array() += 1e-6 * (in.trace().real() + out.trace().real()) / static_cast<double>(in.rows());
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXcd> eigen(in, out);
  SteadyBand band{centre, half, eigen.eigenvectors().col(in.rows() - 1), 0};
  band.chance = steady_chance(spectra.lines.middleRows(centre - half, 2 * half + 1) * band.direction.conjugate());
  return band;
}

/// Sums of the channels' power, each of unit size, behind a Hann window: entry k is that of the lines below k.
VectorXd summed_power(const RecordSpectra& spectra) {
  const Index n = spectra.lines.rows();
  VectorXd sums = VectorXd::Zero(n + 1);
  const VectorXd size = spectra.lines.colwise().squaredNorm();
  for (Index k = 0; k < n; ++k) {
    double power = 0;
    for (Index c = 0; c < size.size() && k > 0 && k + 1 < n; ++c)
      power +=
          std::norm(0.5 * spectra.lines(k, c) - 0.25 * (spectra.lines(k - 1, c) + spectra.lines(k + 1, c))) / size[c];
    sums[k + 1] = sums[k] + power;
  }
  return sums;
}

std::optional<SteadyBand> find_steady_band(const RecordSpectra& spectra, double low, double high) {
  const VectorXd sums = summed_power(spectra);
  const Index last = std::min(spectra.lines.rows() - 1, static_cast<Index>(high / spectra.line()));
  const auto mean = [&](Index from, Index to) {  // lines [from, to)
    from = std::clamp<Index>(from, 0, sums.size() - 1);
    to = std::clamp<Index>(to, 0, sums.size() - 1);
    return to > from ? (sums[to] - sums[from]) / static_cast<double>(to - from) : 0;
  };
  std::optional<SteadyBand> best;
  for (Index half = 2; static_cast<double>(half) * spectra.line() < kWidest * high;
       half += std::max<Index>(1, half / 3)) {
    const Index step = std::max<Index>(1, half / 4), gap = half / 2 + 2, beside = std::max<Index>(2 * half, 12);
    Index first = std::max<Index>(half + gap + 2, static_cast<Index>(low / spectra.line()));
    first = std::max(first, static_cast<Index>(static_cast<double>(half) / kWidest));
    for (Index k = first; k + half < last; k += step) {
      const double in = mean(k - half, k + half + 1);
      const double out = std::max(mean(k - half - gap - beside, k - half - gap),
                                  mean(k + half + gap + 1, k + half + gap + 1 + beside));
      if (in < kStandsOut * out) continue;
      if (in < mean(k - step - half, k - step + half + 1) || in < mean(k + step - half, k + step + half + 1)) continue;
      SteadyBand band = look_at(spectra, k, half);
      if (band.chance < kSteady && (!best || band.chance < best->chance)) best = std::move(band);
    }
  }
  return best;
}

/// A tone that is followed, and what turns with it.
struct FollowedShaft {
  double carrier = 0;        // rad/s
  double dt = 0, reach = 0;  // s between instants; rad/s
  PhaseTrack track;
  ShaftAngle shaft;
  std::vector<double> orders{1};
};

void set_shaft(const RecordSpectra& spectra, FollowedShaft& f) {
  VectorXd angle(spectra.samples);
  for (Index i = 0; i < spectra.samples; ++i) {
    const double t = static_cast<double>(i) * spectra.dt;
    angle[i] = f.carrier * t + phase_at(f.track, f.dt, t);
  }
  f.shaft = shaft_of(std::move(angle), spectra.dt, 2 * f.dt);
}

FollowedShaft follow(const RecordSpectra& spectra, const SteadyBand& band, double high) {
  constexpr double kMostOrder = 6;  // wider bands of higher multiples are cut off
  const Index half = std::min(band.half + band.half / 4 + 2, band.centre - 1);
  const double multiple = std::clamp(high / (static_cast<double>(band.centre) * spectra.line()), 1.0, kMostOrder);
  const Index count = signal::fast_fft_length(static_cast<Index>(2.2 * multiple * static_cast<double>(half)) + 4);
  FollowedShaft f;
  f.carrier = 2 * kPi * static_cast<double>(band.centre) * spectra.line();
  f.dt = static_cast<double>(spectra.samples) * spectra.dt / static_cast<double>(count);
  f.reach = 2 * kPi * static_cast<double>(half) * spectra.line();
  const VectorXcd z = envelopes(spectra, band.centre, half, count) * band.direction.conjugate();
  // Size and noise from the moments of the squared envelope: mean A^2 + s, variance s^2 + 2 A^2 s.
  const VectorXd square = z.cwiseAbs2();
  const double mean = square.mean(), variance = (square.array() - mean).square().mean();
  const double noise = mean - std::sqrt(std::max(0.01 * mean * mean, mean * mean - variance));
  const double size2 = mean - noise;
  const double oversampled = static_cast<double>(count) / static_cast<double>(2 * half + 1);
  f.track = track_phase(z / std::sqrt(size2), oversampled * noise / size2, f.dt, f.reach);
  set_shaft(spectra, f);
  return f;
}

/// The phase by all orders together, each with its own size and noise.
void refine_phase(const RecordSpectra& spectra, FollowedShaft& f) {
  const Index count = f.track.phase.size();
  VectorXd sum = VectorXd::Zero(count), weight = VectorXd::Zero(count);
  for (const double order : f.orders) {
    const double reach = std::max(1.0, order) * f.reach / (2 * kPi * spectra.line());
    const Index half = std::clamp<Index>(static_cast<Index>(reach), 4, count / 2 - 1);
    const OrderFit fit = fit_order(spectra, f.shaft, order, half, count);
    const MatrixXcd weighted =
        MatrixXcd(fit.noise.transpose()).ldlt().solve(MatrixXcd(fit.model.transpose())).transpose();
    for (Index i = 0; i < count; ++i) {
      const double information = (fit.model.row(i).conjugate().cwiseProduct(weighted.row(i))).sum().real();
      const double off = (weighted.row(i).conjugate().cwiseProduct(fit.residual.row(i))).sum().imag() / information;
      const double w = 2 * information * order * order / fit.oversampled;
      sum[i] += w * std::clamp(off, -1.0, 1.0) / order;
      weight[i] += w;
    }
  }
  const VectorXd noise = weight.cwiseMax(1e-12).cwiseInverse();
  f.track = smooth_phase(f.track, sum.cwiseProduct(noise), noise, f.dt, f.reach);
  set_shaft(spectra, f);
}

/// Multiples m/n of what turns that the record shows.
void find_related(const RecordSpectra& spectra, const ShaftAngle& shaft, double low, double high,
                  std::vector<double>& orders) {
  constexpr int kMostParts = 4, kMostMultiple = 20;
  for (int n = 1; n <= kMostParts; ++n) {
    for (int m = 1; m <= kMostMultiple; ++m) {
      const double order = static_cast<double>(m) / n, frequency = order * shaft.frequency;
      if (std::gcd(m, n) != 1 || frequency < low || frequency > high) continue;
      if (std::find(orders.begin(), orders.end(), order) != orders.end()) continue;
      if (order_chance(spectra, shaft, order) < kOrderShown) orders.push_back(order);
    }
  }
}

}  // namespace

std::vector<Tone> take_off_multiples(MatrixXd& y, double dt, double frequency, double low, double high) {
  const Index n = y.rows();
  const VectorXd angle = VectorXd::LinSpaced(n, 0, 2 * kPi * frequency * dt * static_cast<double>(n - 1));
  const ShaftAngle shaft{angle, VectorXd::Zero(n), VectorXd::Zero(n), frequency, 1e-12};
  std::vector<double> orders{1};
  find_related(spectra_of(y, dt), shaft, low, high, orders);
  std::vector<Tone> tones;
  for (std::size_t k = 1; k < orders.size(); ++k) {
    tones.push_back(take_off_order(y, shaft, orders[k], 1));
    tones.back().evidence = fmt::format("{:.4g} times the tone at {:.5g} Hz", orders[k], frequency);
  }
  return tones;
}

std::vector<Tone> take_off_wandering_tones(MatrixXd& y, double dt, double low, double high) {
  std::vector<Tone> tones;
  for (int round = 0; round < kMostShafts; ++round) {
    const RecordSpectra spectra = spectra_of(y, dt);
    const std::optional<SteadyBand> band = find_steady_band(spectra, low, high);
    if (!band) break;
    FollowedShaft f = follow(spectra, *band, high);
    for (int pass = 0; pass < 2; ++pass) {
      refine_phase(spectra, f);
      find_related(spectra, f.shaft, low, high, f.orders);
    }
    for (int pass = 0; pass < 2; ++pass) refine_phase(spectra, f);
    const Index count = f.track.phase.size();
    for (const double order : f.orders) {
      const double reach = std::max(1.0, order) * f.reach / (2 * kPi * spectra.line());
      const OrderFit fit =
          fit_order(spectra, f.shaft, order, std::clamp<Index>(static_cast<Index>(reach), 4, count / 2 - 1), count);
      Tone tone = take_off_order(y, f.shaft, order, fit.terms);
      tone.evidence = order == 1 ? fmt::format("steady amplitude, frequency wanders by {:.2g} %", 100 * f.shaft.wander)
                                 : fmt::format("{:.4g} times the tone at {:.5g} Hz, which wanders by {:.2g} %", order,
                                               f.shaft.frequency, 100 * f.shaft.wander);
      tones.push_back(std::move(tone));
    }
  }
  return tones;
}

std::vector<Tone> take_off_shaft_orders(MatrixXd& y, double dt, const VectorXd& angle, double high) {
  constexpr int kMostHalves = 40;
  const RecordSpectra spectra = spectra_of(y, dt);
  ShaftAngle shaft = shaft_of(angle[angle.size() - 1] < angle[0] ? VectorXd(-angle) : angle, dt, 1);
  std::vector<Tone> tones;
  for (int halves = 1; halves <= kMostHalves; ++halves) {
    const double order = 0.5 * halves;
    if (order * shaft.frequency > high) break;
    if (order_chance(spectra, shaft, order) >= kOrderShown) continue;
    const double reach = 4 * order * shaft.frequency * shaft.wander / spectra.line();
    const Index half = static_cast<Index>(reach) + 40;
    Tone tone = take_off_order(y, shaft, order,
                               fit_order(spectra, shaft, order, half, signal::fast_fft_length(2 * half + 2)).terms);
    tone.evidence = fmt::format("order {:g} of the rotor's angle", order);
    tones.push_back(std::move(tone));
  }
  return tones;
}

}  // namespace whirl::modal
