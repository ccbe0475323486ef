#pragma once
#include "whirl/testing/roving.hpp"

namespace whirl::testing {

/// Several blows at each reference while the structure warms or cools: every blow sees its own natural frequencies, the
/// same for all responses. The FRFs are means over the blows, with the variance that their scatter shows.
struct DriftOptions {
  RovingOptions structure;
  int blows = 5;
  double drift = 2e-4;  ///< relative sd of each natural frequency between blows
};

inline Roving make_drifting(const DriftOptions& o) {
  std::mt19937_64 random(7'000'003ull * o.structure.seed + 11);
  std::normal_distribution<double> normal;
  RovingOptions clean = o.structure;
  clean.noise = clean.frequency_scatter = clean.damping_scatter = clean.common_noise = 0;
  Roving result = make_roving(clean);
  // Modes above the band stay; those inside are taken out and put back where each blow sees them.
  const auto references = static_cast<std::size_t>(clean.references),
             responses = static_cast<std::size_t>(clean.responses);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<std::vector<double>> shape(result.frequency.size());
  for (auto& s : shape) {
    for (std::size_t i = 0; i < references + responses; ++i)
      s.push_back((uniform(random) < 0.5 ? -1 : 1) * (0.25 + 0.75 * uniform(random)));
  }
  const auto& axis = result.frf.frequency;
  const auto n = static_cast<double>(o.blows);
  for (std::size_t r = 0; r < references; ++r) {
    std::vector<Eigen::MatrixXcd> blows;
    for (int b = 0; b < o.blows; ++b) {
      Eigen::MatrixXcd h = Eigen::MatrixXcd::Zero(axis.size(), clean.responses);
      for (std::size_t k = 0; k < shape.size(); ++k) {
        const double w0 = 2 * std::numbers::pi * result.frequency[k] * (1 + o.drift * normal(random));
        for (Eigen::Index i = 0; i < axis.size(); ++i) {
          const double w = 2 * std::numbers::pi * axis[i];
          const std::complex<double> one =
              -w * w / std::complex<double>(w0 * w0 - w * w, 2 * result.damping[k] * w0 * w);
          for (std::size_t p = 0; p < responses; ++p)
            h(i, static_cast<Eigen::Index>(p)) += shape[k][p] * shape[k][responses + r] * one;
        }
      }
      const double rms = h.norm() / std::sqrt(static_cast<double>(h.size()));
      const double sd = o.structure.noise * rms * std::sqrt(n / 2);
      for (Eigen::Index i = 0; i < h.size(); ++i)
        h(i) += std::complex<double>(sd * normal(random), sd * normal(random));
      blows.push_back(std::move(h));
    }
    Eigen::MatrixXcd mean = Eigen::MatrixXcd::Zero(axis.size(), clean.responses);
    for (const auto& h : blows) mean += h / n;
    Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(axis.size(), clean.responses);
    for (const auto& h : blows) squares += (h - mean).cwiseAbs2();
    for (std::size_t p = 0; p < responses; ++p) {
      FrfChannel& channel = result.frf.channels[r * responses + p];
      channel.value = mean.col(static_cast<Eigen::Index>(p));
      channel.variance = squares.col(static_cast<Eigen::Index>(p)) / (2 * n * (n - 1));
    }
  }
  result.frf.averages = o.blows;
  return result;
}

}  // namespace whirl::testing
