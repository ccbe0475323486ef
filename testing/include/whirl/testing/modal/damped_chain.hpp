#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/modal_model.hpp"

namespace whirl::testing {

/// Masses between springs and dashpots, most of them on the ground too: modes of 5 to 50 % damping that overlap.
struct DampedChainOptions {
  int masses = 9, responses = 6, references = 2;
  double least_damping = 0.05, most_damping = 0.5;
  double noise = 0.001;            ///< of rms |H|
  double worst_deviation = 0.003;  ///< relative Cramer-Rao deviation of a frequency, above which a draw is left out
  int lines = 1000;
  unsigned seed = 1;
};

struct DampedChain {
  std::vector<double> frequency, damping;  ///< Hz, undamped; ratio
  std::vector<double> deviation;           ///< Cramer-Rao deviation of the frequency, Hz
  FrequencyResponse frf;
};

namespace damped_chain {

/// Deviations of the frequencies that no unbiased estimator of poles and complex residues falls below. Every channel
/// has its own white noise of `sd` per real part.
inline std::vector<double> cramer_rao(const std::vector<std::complex<double>>& poles, const Eigen::VectorXd& omega,
                                      const std::vector<Eigen::VectorXcd>& residues, const std::vector<double>& sd,
                                      int power) {
  using Complex = std::complex<double>;
  const auto n = static_cast<Eigen::Index>(poles.size()), lines = omega.size();
  Eigen::MatrixXd columns(2 * lines, 2 * n);
  const auto put = [&](Eigen::MatrixXd& to, Eigen::Index column, const Eigen::VectorXcd& v) {
    to.col(column) << v.real(), v.imag();
  };
  const auto part = [&](Complex p, int m) {
    Eigen::VectorXcd v(lines);
    for (Eigen::Index i = 0; i < lines; ++i) {
      const Complex s(0, omega[i]);
      v[i] = std::pow(s, power) / std::pow(s - p, m);
    }
    return v;
  };
  std::vector<Eigen::VectorXcd> one, other, one2, other2;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Complex p = poles[static_cast<std::size_t>(k)];
    one.push_back(part(p, 1)), other.push_back(part(std::conj(p), 1));
    one2.push_back(part(p, 2)), other2.push_back(part(std::conj(p), 2));
    put(columns, 2 * k, one.back() + other.back());
    put(columns, 2 * k + 1, Complex(0, 1) * (one.back() - other.back()));
  }
  const Eigen::VectorXd scale = columns.colwise().norm().cwiseInverse();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(columns * scale.asDiagonal());
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(2 * lines, 2 * n);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  for (std::size_t c = 0; c < residues.size(); ++c) {
    Eigen::MatrixXd slope(2 * lines, 2 * n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const Complex a = residues[c][k];
      put(slope, 2 * k, a * one2[at] + std::conj(a) * other2[at]);
      put(slope, 2 * k + 1, Complex(0, 1) * (a * one2[at] - std::conj(a) * other2[at]));
    }
    const Eigen::MatrixXd along = q.transpose() * slope;
    slope -= q * along;
    const Eigen::MatrixXd square = slope.transpose() * slope;
    information += square / (sd[c] * sd[c]);
  }
  const Eigen::VectorXd unit = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const Eigen::MatrixXd covariance = unit.asDiagonal() * inverse(scaled) * unit.asDiagonal();
  std::vector<double> result;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Complex p = poles[static_cast<std::size_t>(k)];
    const Eigen::Vector2d slope(p.real() / std::abs(p), p.imag() / std::abs(p));
    result.push_back(std::sqrt(slope.dot(covariance.block<2, 2>(2 * k, 2 * k) * slope)) / (2 * std::numbers::pi));
  }
  return result;
}

}  // namespace damped_chain

/// Lines from the matrices themselves, (K + j w C - w^2 M)^-1 as accelerance; poles from the state matrix. Draws with a
/// damping outside the range, or a frequency that the lines hardly show, are left out.
inline DampedChain make_damped_chain(const DampedChainOptions& o) {
  using Complex = std::complex<double>;
  std::mt19937_64 random(6364136223ull * o.seed + 1442695ull);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const auto drawn_log = [&](double a, double b) { return a * std::pow(b / a, uniform(random)); };
  const Eigen::Index n = o.masses;
  for (int draw = 0; draw < 20000; ++draw) {
    Eigen::MatrixXd k = Eigen::MatrixXd::Zero(n, n), c = k;
    Eigen::VectorXd mass(n);
    const double level = drawn_log(0.1, 0.5);
    for (Eigen::Index i = 0; i < n; ++i) {
      mass[i] = drawn_log(0.3, 3);
      const double own = mass[i] * std::pow(2 * std::numbers::pi * drawn_log(8, 80), 2);
      k(i, i) += own;
      c(i, i) += 2 * level * drawn_log(0.3, 2) * std::sqrt(own * mass[i]);
      if (i == 0) continue;
      const double between = own * drawn_log(0.03, 0.3),
                   lost = level * drawn_log(0.3, 2) * std::sqrt(between * mass[i]);
      for (const auto& [matrix, value] : {std::pair{&k, between}, std::pair{&c, lost}}) {
        (*matrix)(i, i) += value;
        (*matrix)(i - 1, i - 1) += value;
        (*matrix)(i, i - 1) -= value;
        (*matrix)(i - 1, i) -= value;
      }
    }
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(2 * n, 2 * n);
    a.topRightCorner(n, n).setIdentity();
    a.bottomLeftCorner(n, n) = -(mass.cwiseInverse().asDiagonal() * k);
    a.bottomRightCorner(n, n) = -(mass.cwiseInverse().asDiagonal() * c);
    const Eigen::EigenSolver<Eigen::MatrixXd> eigen(a);
    std::vector<Complex> poles;
    std::vector<Eigen::Index> at;
    const Eigen::MatrixXcd right = eigen.eigenvectors(), left = right.inverse();
    for (Eigen::Index i = 0; i < 2 * n; ++i) {
      if (!(eigen.eigenvalues()[i].imag() > 0)) continue;
      poles.push_back(eigen.eigenvalues()[i]);
      at.push_back(i);
    }
    const auto outside = [&](Complex p) {
      const double zeta = -p.real() / std::abs(p);
      return zeta < o.least_damping || zeta > o.most_damping;
    };
    if (static_cast<Eigen::Index>(poles.size()) < n || std::any_of(poles.begin(), poles.end(), outside)) continue;
    double low = INFINITY, high = 0;
    for (const Complex p : poles) {
      low = std::min(low, std::abs(p) / (2 * std::numbers::pi));
      high = std::max(high, std::abs(p) / (2 * std::numbers::pi));
    }
    DampedChain result;
    result.frf.kind = FrfKind::accelerance;
    result.frf.frequency = Eigen::VectorXd::LinSpaced(o.lines, 0.2 * low, 2 * high);
    const Eigen::VectorXd omega = 2 * std::numbers::pi * result.frf.frequency;
    std::vector<Eigen::VectorXcd> residues;
    std::vector<double> sd;
    for (int r = 0; r < o.references; ++r) {
      for (int p = 0; p < o.responses; ++p) {
        result.frf.channels.push_back(
            {"p" + std::to_string(p), "h" + std::to_string(r), Eigen::VectorXcd(o.lines), {}, {}});
        const Eigen::Index out = p * n / o.responses, in = r * (n - 1) / std::max(1, o.references - 1);
        Eigen::VectorXcd one(static_cast<Eigen::Index>(poles.size()));
        for (std::size_t m = 0; m < poles.size(); ++m)
          one[static_cast<Eigen::Index>(m)] = right(out, at[m]) * left(at[m], n + in) / mass[in];
        residues.push_back(one);
      }
    }
    for (Eigen::Index i = 0; i < o.lines; ++i) {
      const double w = omega[i];
      Eigen::MatrixXcd z = k.cast<Complex>() + Complex(0, w) * c.cast<Complex>();
      z.diagonal() -= (w * w * mass).cast<Complex>();
      const Eigen::MatrixXcd h = z.inverse();
      std::size_t channel = 0;
      for (int r = 0; r < o.references; ++r)
        for (int p = 0; p < o.responses; ++p, ++channel)
          result.frf.channels[channel].value[i] =
              -w * w * h(p * n / o.responses, r * (n - 1) / std::max(1, o.references - 1));
    }
    for (FrfChannel& channel : result.frf.channels) {
      const double rms = channel.value.norm() / std::sqrt(static_cast<double>(o.lines));
      sd.push_back(o.noise * rms / std::numbers::sqrt2);
      for (Complex& h : channel.value) h += sd.back() * Complex(normal(random), normal(random));
    }
    result.deviation = damped_chain::cramer_rao(poles, omega, residues, sd, 2);
    bool shown = true;
    for (std::size_t m = 0; m < poles.size(); ++m) {
      result.frequency.push_back(std::abs(poles[m]) / (2 * std::numbers::pi));
      result.damping.push_back(-poles[m].real() / std::abs(poles[m]));
      shown = shown && result.deviation[m] < o.worst_deviation * result.frequency[m];
    }
    if (shown) return result;
  }
  return {};
}

}  // namespace whirl::testing
