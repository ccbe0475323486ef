// Orders of a shaft whose angle is known: whether the record has them, and what they are as a function of the speed.
#include "shaft_orders.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr Index kOrderTerms = 6, kBandDirections = 6;

Index sample_of(Index instant, Index count, Index samples) {
  return std::min(samples - 1, (instant * samples + count / 2) / count);
}

/// The strongest directions of the columns, where there are many.
MatrixXcd strongest_directions(const MatrixXcd& z) {
  if (z.cols() <= kBandDirections) return z;
  const Eigen::SelfAdjointEigenSolver<MatrixXcd> eigen(MatrixXcd(z.adjoint() * z));
  return z * eigen.eigenvectors().rightCols(kBandDirections);
}

/// Turns the envelopes about a line back by an order's own phase.
MatrixXcd turned_back(const RecordSpectra& spectra, const ShaftAngle& shaft, double order, Index centre, Index half,
                      Index count) {
  MatrixXcd z = envelopes(spectra, centre, half, count);
  for (Index i = 0; i < count; ++i) {
    const Index sample = sample_of(i, count, spectra.samples);
    // The envelope is that at the instant itself: the angle is carried there from the nearest sample.
    const double at = static_cast<double>(i) * static_cast<double>(spectra.samples) / static_cast<double>(count);
    const double beyond = (at - static_cast<double>(sample)) * spectra.dt;
    const double speed = 2 * kPi * shaft.frequency * (1 + shaft.wander * shaft.deviation[sample]);
    const double carrier = 2 * kPi * static_cast<double>(centre) * static_cast<double>(i) / static_cast<double>(count);
    z.row(i) *= std::polar(1.0, carrier - order * (shaft.angle[sample] + speed * beyond));
  }
  return z;
}

}  // namespace

RecordSpectra spectra_of(const MatrixXd& y, double dt) {
  RecordSpectra spectra{MatrixXcd(y.rows() / 2 + 1, y.cols()), y.rows(), dt};
  for (Index c = 0; c < y.cols(); ++c) spectra.lines.col(c) = signal::real_fft(y.col(c));
  return spectra;
}

MatrixXcd envelopes(const RecordSpectra& spectra, Index centre, Index half, Index count) {
  MatrixXcd z(count, spectra.lines.cols());
  const double scale = 2 * static_cast<double>(count) / static_cast<double>(spectra.samples);
  for (Index c = 0; c < z.cols(); ++c) {
    VectorXcd band = VectorXcd::Zero(count);
    for (Index k = -half; k <= half; ++k) {
      const Index from = centre + k;
      if (from > 0 && from < spectra.lines.rows()) band[k < 0 ? k + count : k] = scale * spectra.lines(from, c);
    }
    z.col(c) = signal::inverse_fft(band);
  }
  return z;
}

ShaftAngle shaft_of(VectorXd angle, double dt, double smooth) {
  ShaftAngle shaft;
  const Index n = angle.size();
  shaft.frequency = (angle[n - 1] - angle[0]) / (2 * kPi * dt * static_cast<double>(n - 1));
  const Index half = std::clamp<Index>(static_cast<Index>(0.5 * smooth / dt), 1, n / 8);
  VectorXd speed(n);
  for (Index i = 0; i < n; ++i) {
    const Index a = std::max<Index>(0, i - half), b = std::min(n - 1, i + half);
    speed[i] = (angle[b] - angle[a]) / (2 * kPi * dt * static_cast<double>(b - a)) / shaft.frequency - 1;
  }
  shaft.wander = std::max(1e-12, std::sqrt((speed.array() - speed.mean()).square().mean()));
  shaft.deviation = (speed.array() - speed.mean()) / shaft.wander;
  shaft.rate = VectorXd::Zero(n);
  for (Index i = 0; i < n; ++i) {
    const Index a = std::max<Index>(0, i - half), b = std::min(n - 1, i + half);
    shaft.rate[i] = (shaft.deviation[b] - shaft.deviation[a]) / static_cast<double>(b - a);
  }
  shaft.rate /= std::max(1e-300, std::sqrt(shaft.rate.squaredNorm() / static_cast<double>(n)));
  shaft.angle = std::move(angle);
  return shaft;
}

MatrixXd order_terms(const ShaftAngle& shaft, Index terms) {
  const Index n = shaft.angle.size();
  MatrixXd columns(n, terms);
  for (Index i = 0; i < n; ++i) {
    const double u = shaft.deviation[i], t = 2 * static_cast<double>(i) / static_cast<double>(n) - 1;
    const double all[kOrderTerms] = {1, u, shaft.rate[i], u * u, u * u * u, t};
    for (Index k = 0; k < terms; ++k) columns(i, k) = all[k];
  }
  return columns;
}

double line_chance(const VectorXcd& own, const MatrixXcd& about) {
  constexpr double kHannShare = 1 / 1.5;  // independent lines behind a Hann window
  const double members = static_cast<double>(about.rows()), d = static_cast<double>(own.size());
  MatrixXcd covariance = about.transpose() * about.conjugate() / members;
  covariance.diagonal().array() += 1e-9 * covariance.trace().real() + 1e-300;
  const double square = own.dot(covariance.ldlt().solve(own)).real();
  if (!(square > 0)) return 0;  // too few lines to compare with (not a number), or nothing: no evidence
  const double n = std::max(d, kHannShare * members);
  return std::log(std::max(1e-300, fisher_f_tail(2 * d, 2 * (n - d + 1), square / n * (n - d + 1) / d)));
}

double order_chance(const RecordSpectra& spectra, const ShaftAngle& shaft, double order) {
  const auto centre = static_cast<Index>(std::lround(order * shaft.frequency / spectra.line()));
  const double reach = 4 * order * shaft.frequency * shaft.wander / spectra.line();
  const Index half = std::min(spectra.lines.rows() / 4, static_cast<Index>(reach) + 2 * kAboutLast);
  const Index count = signal::fast_fft_length(2 * half + 2);
  MatrixXcd z = strongest_directions(turned_back(spectra, shaft, order, centre, half, count));
  for (Index i = 0; i < count; ++i)
    z.row(i) *= 1 - std::cos(2 * kPi * (static_cast<double>(i) + 0.5) / static_cast<double>(count));
  MatrixXcd about(2 * (kAboutLast - kAboutFirst + 1), z.cols());
  VectorXcd own(z.cols());
  for (Index c = 0; c < z.cols(); ++c) {
    const VectorXcd lines = signal::fft(z.col(c));
    own[c] = lines[0];
    for (Index k = kAboutFirst, row = 0; k <= kAboutLast; ++k) {
      about(row++, c) = lines[k];
      about(row++, c) = lines[count - k];
    }
  }
  return line_chance(own, about);
}

OrderFit fit_order(const RecordSpectra& spectra, const ShaftAngle& shaft, double order, Index half, Index count) {
  const auto centre = static_cast<Index>(std::lround(order * shaft.frequency / spectra.line()));
  const MatrixXcd z = strongest_directions(turned_back(spectra, shaft, order, centre, half, count));
  const MatrixXd all = order_terms(shaft, kOrderTerms);
  MatrixXd columns(count, kOrderTerms);
  for (Index i = 0; i < count; ++i) columns.row(i) = all.row(sample_of(i, count, spectra.samples));
  OrderFit best;
  double least = INFINITY;
  const double samples = static_cast<double>(2 * half + 1), d = static_cast<double>(z.cols());
  for (Index terms = 1; terms <= kOrderTerms; ++terms) {
    const MatrixXd a = columns.leftCols(terms);
    const Eigen::LDLT<MatrixXd> normal(MatrixXd(a.transpose() * a));
    OrderFit fit;
    fit.terms = terms;
    fit.model = a * MatrixXcd(normal.solve(MatrixXd(a.transpose() * z.real())).cast<Complex>() +
                              Complex(0, 1) * normal.solve(MatrixXd(a.transpose() * z.imag())).cast<Complex>());
    fit.residual = z - fit.model;
    fit.noise = fit.residual.adjoint() * fit.residual / static_cast<double>(count);
    fit.noise.diagonal().array() += 1e-9 * fit.noise.trace().real() / d;
    fit.oversampled = static_cast<double>(count) / samples;
    const MatrixXcd lower = fit.noise.llt().matrixL();
    const double length = 4 * samples * lower.diagonal().real().array().log().sum() +
                          2 * d * static_cast<double>(terms) * std::log(2 * samples * d);
    if (length >= least) continue;
    least = length;
    best = std::move(fit);
  }
  return best;
}

Tone take_off_order(MatrixXd& y, const ShaftAngle& shaft, double order, Index terms) {
  const MatrixXd amplitude = order_terms(shaft, terms);
  MatrixXd columns(y.rows(), 2 * terms);
  for (Index i = 0; i < y.rows(); ++i) {
    const double phase = order * shaft.angle[i];
    columns.row(i).head(terms) = std::cos(phase) * amplitude.row(i);
    columns.row(i).tail(terms) = std::sin(phase) * amplitude.row(i);
  }
  const MatrixXd x =
      Eigen::LDLT<MatrixXd>(MatrixXd(columns.transpose() * columns)).solve(MatrixXd(columns.transpose() * y));
  Tone tone;
  tone.frequency = order * shaft.frequency;
  tone.amplitude.resize(y.cols());
  const double n = static_cast<double>(y.rows());
  for (Index c = 0; c < y.cols(); ++c)
    tone.amplitude[c] = std::sqrt(
        ((amplitude * x.col(c).head(terms)).squaredNorm() + (amplitude * x.col(c).tail(terms)).squaredNorm()) / n);
  y -= columns * x;
  return tone;
}

}  // namespace whirl::modal
