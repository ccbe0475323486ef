#include "tones.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>

#include "shaft_orders.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::LDLT;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

// Lines of all channels, each scaled to unit variance, behind a Hann window.
MatrixXcd hann_lines(const MatrixXd& y) {
  VectorXd window(y.rows());
  for (Index i = 0; i < y.rows(); ++i)
    window[i] = 0.5 - 0.5 * std::cos(2 * kPi * (static_cast<double>(i) + 0.5) / static_cast<double>(y.rows()));
  MatrixXcd lines = MatrixXcd::Zero(y.rows() / 2 + 1, y.cols());
  for (Index c = 0; c < y.cols(); ++c) {
    const VectorXd x = y.col(c).cwiseProduct(window);
    const double size = x.norm();
    if (size > 0) lines.col(c) = signal::real_fft(x) / size;
  }
  return lines;
}

// A line against those about it, in the directions that are strongest there: a tone within the peak of a mode stands
// in one line, and seldom in the direction of the mode.
double tone_chance(const MatrixXcd& lines, Index k) {
  MatrixXcd about(2 * (kAboutLast - kAboutFirst + 1), lines.cols());
  for (Index i = kAboutFirst, row = 0; i <= kAboutLast; ++i) {
    about.row(row++) = lines.row(k - i);
    about.row(row++) = lines.row(k + i);
  }
  constexpr Index kToneDirections = 6;
  if (lines.cols() <= kToneDirections) return line_chance(lines.row(k).transpose(), about);
  const Eigen::SelfAdjointEigenSolver<MatrixXcd> eigen(
      MatrixXcd(about.adjoint() * about + lines.row(k).adjoint() * lines.row(k)));
  const MatrixXcd strongest = eigen.eigenvectors().rightCols(kToneDirections);
  return line_chance((lines.row(k) * strongest).transpose(), about * strongest);
}

// Cosine and sine of a frequency about the middle of the record.
MatrixXd tone_columns(Index n, double dt, double frequency) {
  MatrixXd columns(n, 2);
  for (Index i = 0; i < n; ++i) {
    const double angle = 2 * kPi * frequency * dt * (static_cast<double>(i) - 0.5 * static_cast<double>(n));
    columns(i, 0) = std::cos(angle);
    columns(i, 1) = std::sin(angle);
  }
  return columns;
}

double tone_energy(const MatrixXd& y, double dt, double frequency) {
  const MatrixXd columns = tone_columns(y.rows(), dt, frequency);
  const MatrixXd products = columns.transpose() * y;
  return (MatrixXd(columns.transpose() * columns).ldlt().solve(products).cwiseProduct(products)).sum();
}

}  // namespace

std::vector<Tone> find_tones(const MatrixXd& y, double dt, double low, double high) {
  const MatrixXcd lines = hann_lines(y);
  const VectorXd power = lines.cwiseAbs2().rowwise().sum();
  const double line = 1 / (dt * static_cast<double>(y.rows()));
  std::vector<Tone> tones;
  for (Index k = std::max<Index>(30, static_cast<Index>(low / line)); k + 31 < power.size(); ++k) {
    if (static_cast<double>(k) * line > high) break;
    if (power[k] < power.segment(k - 2, 5).maxCoeff()) continue;
    // A tone fills three lines behind a Hann window; random response as narrow as a few lines does not stand so far out
    // of the nearest lines.
    std::vector<double> near;
    for (Index i = 4; i <= 12; ++i) {
      near.push_back(power[k - i]);
      near.push_back(power[k + i]);
    }
    const double mean = std::max(1e-300, VectorXd::Map(near.data(), static_cast<Index>(near.size())).mean());
    const double chance = std::log(static_cast<double>(power.size())) + 6;  // of exponential lines, of one channel
    constexpr double kLooksOut = 5, kInOneLine = -24;  // the latter: logarithm of a chance, 1e-6 over 20 000 lines
    if (power[k] < 3 * chance * mean && (power[k] < kLooksOut * mean || tone_chance(lines, k) > kInOneLine)) continue;
    Tone tone;
    tone.frequency = static_cast<double>(k) * line;
    tone.evidence = fmt::format("spectral line {:.0f} times its surroundings", power[k] / mean);
    tones.push_back(std::move(tone));
  }
  return tones;
}

void subtract_tone(MatrixXd& y, double dt, Tone& tone) {
  const double line = 1 / (dt * static_cast<double>(y.rows()));
  const double start = tone.frequency;
  const auto less_energy = [&](double lines) { return -tone_energy(y, dt, start + lines * line); };
  tone.frequency = start + line * boost::math::tools::brent_find_minima(less_energy, -0.7, 0.7, 14).first;
  const MatrixXd columns = tone_columns(y.rows(), dt, tone.frequency);
  const MatrixXd x = MatrixXd(columns.transpose() * columns).ldlt().solve(MatrixXd(columns.transpose() * y));
  y -= columns * x;
  tone.amplitude = x.colwise().norm().transpose();
}

Tone subtract_order(MatrixXd& y, const VectorXd& angle, double dt, int order) {
  const Index n = y.rows();
  const double turns = std::abs(angle[n - 1] - angle[0]) / (2 * kPi);
  const Index blocks = std::clamp<Index>(static_cast<Index>(turns / 40), 1, n / 64);
  Tone tone;
  tone.frequency = order * turns / (dt * static_cast<double>(n - 1));
  tone.amplitude = VectorXd::Zero(y.cols());
  tone.evidence = fmt::format("order {} of the rotor's angle", order);
  for (Index b = 0; b < blocks; ++b) {
    const Index first = b * n / blocks, count = (b + 1) * n / blocks - first;
    MatrixXd columns(count, 4);
    for (Index i = 0; i < count; ++i) {
      const double at = 2 * static_cast<double>(i) / static_cast<double>(count) - 1, phase = order * angle[first + i];
      columns.row(i) << std::cos(phase), std::sin(phase), at * std::cos(phase), at * std::sin(phase);
    }
    const MatrixXd x = LDLT<MatrixXd>(MatrixXd(columns.transpose() * columns))
                           .solve(MatrixXd(columns.transpose() * y.middleRows(first, count)));
    y.middleRows(first, count) -= columns * x;
    tone.amplitude += x.topRows(2).colwise().norm().transpose() / static_cast<double>(blocks);
  }
  return tone;
}

double band_kurtosis(const MatrixXd& y, double dt, double frequency, double half_width) {
  const double line = 1 / (dt * static_cast<double>(y.rows()));
  const Index first = std::max<Index>(1, static_cast<Index>((frequency - half_width) / line)),
              last = std::min<Index>(y.rows() / 2 - 1, static_cast<Index>((frequency + half_width) / line) + 1);
  double best = -1, kurtosis = 3;
  for (Index c = 0; c < y.cols(); ++c) {
    const Eigen::VectorXcd all = signal::real_fft(y.col(c));
    Eigen::VectorXcd kept = Eigen::VectorXcd::Zero(last - first + 1);
    kept = all.segment(first, last - first + 1);
    if (kept.squaredNorm() <= best) continue;
    best = kept.squaredNorm();
    // The envelope: shifted to 0 Hz. Kurtosis of the oscillation = 1.5 mean|a|^4 / (mean|a|^2)^2.
    Eigen::VectorXcd padded = Eigen::VectorXcd::Zero(signal::fast_fft_length(4 * kept.size()));
    padded.head(kept.size()) = kept;
    const VectorXd square = signal::inverse_fft(padded).cwiseAbs2();
    kurtosis = 1.5 * square.squaredNorm() / static_cast<double>(square.size()) / std::pow(square.mean(), 2);
  }
  return kurtosis;
}

}  // namespace whirl::modal
