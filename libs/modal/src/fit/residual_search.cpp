#include "residual_search.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;

double median_of(Eigen::VectorXd values) {
  std::nth_element(values.data(), values.data() + values.size() / 2, values.data() + values.size());
  return values[values.size() / 2];
}

// Sums over blocks of 2^level lines: a wide peak needs no more than a few blocks per half-width.
struct Level {
  Eigen::MatrixXcd data;   // sum of W^2 r
  Eigen::MatrixXd weight;  // sum of W^2
  Eigen::VectorXd omega;   // mean
};

std::vector<Level> pyramid(const Band& band, const Eigen::MatrixXcd& residual, int levels) {
  const Eigen::MatrixXd w2 = band.weight.cwiseAbs2();
  std::vector<Level> result{{residual.cwiseProduct(w2.cast<Complex>()), w2, band.omega}};
  for (int level = 1; level < levels; ++level) {
    const Level& fine = result.back();
    const Index n = fine.omega.size() / 2;
    Level coarse{Eigen::MatrixXcd(n, band.channels()), Eigen::MatrixXd(n, band.channels()), Eigen::VectorXd(n)};
    for (Index i = 0; i < n; ++i) {
      coarse.data.row(i) = fine.data.row(2 * i) + fine.data.row(2 * i + 1);
      coarse.weight.row(i) = fine.weight.row(2 * i) + fine.weight.row(2 * i + 1);
      coarse.omega[i] = 0.5 * (fine.omega[2 * i] + fine.omega[2 * i + 1]);
    }
    result.push_back(std::move(coarse));
  }
  return result;
}

struct Candidate {
  double gain;
  Complex pole;
  Index from, to;  // lines about it
};

constexpr double kSmallest = 0.1;  // of the largest gain: smaller ones are no peaks

bool larger(const Candidate& a, const Candidate& b) { return a.gain > b.gain; }

/// Where everything nearby is large, a peak has to stand out from that. Only of those that may be peaks afterwards: the
/// gain becomes no larger.
std::vector<Candidate> standing_out(std::vector<Candidate> found, const Eigen::VectorXd& energy, double floor,
                                    double least_gain) {
  std::sort(found.begin(), found.end(), larger);
  std::vector<Candidate> result;
  double largest = 0;
  for (Candidate& c : found) {
    if (c.gain < kSmallest * largest) break;
    c.gain *= floor / std::max(floor, median_of(energy.segment(c.from, c.to - c.from + 1)));
    if (!(c.gain > least_gain)) continue;
    largest = std::max(largest, c.gain);
    result.push_back(c);
  }
  std::sort(result.begin(), result.end(), larger);
  return result;
}

}  // namespace

std::vector<Complex> search_residual(const Band& band, const Eigen::MatrixXcd& residual, double least_gain) {
  const Index n = band.lines();
  const double df = band.line_width();
  const Eigen::VectorXd energy = residual.cwiseProduct(band.weight.cast<Complex>()).cwiseAbs2().rowwise().sum();
  const double data = band.h.cwiseProduct(band.weight.cast<Complex>()).squaredNorm() / static_cast<double>(n);
  const double floor = std::max(median_of(energy), 1e-10 * data);
  constexpr int kLevels = 8;
  const std::vector<Level> levels = pyramid(band, residual, kLevels);

  std::vector<Candidate> found;
  for (double zeta = 0.001; zeta < 0.04; zeta *= 1.7) {
    for (double f = band.low; f <= kReach * band.high; f += std::max(0.5 * df, 0.5 * zeta * f)) {
      const double half_width = zeta * f + std::max(0.0, f - band.high);  // of the part that is seen, Hz
      const int level = std::clamp(static_cast<int>(std::log2(std::max(1.0, half_width / df / 4))), 0, kLevels - 1);
      const Level& at = levels[static_cast<std::size_t>(level)];
      const Index lines = at.omega.size();
      const double width = df * std::pow(2.0, level);
      const Index centre = std::min(lines - 1, static_cast<Index>((f - band.low) / width));
      const Index half = static_cast<Index>(6 * half_width / width) + 8;
      const Index first = std::max<Index>(0, centre - half), count = std::min(lines - 1, centre + half) - first + 1;
      const Complex q = 2 * kPi * f * Complex(-zeta, std::sqrt(1 - zeta * zeta));
      Eigen::VectorXcd b(count);
      for (Index i = 0; i < count; ++i) b[i] = 1.0 / (Complex(band.decay, at.omega[first + i]) - q);
      const Eigen::RowVectorXcd products = b.adjoint() * at.data.middleRows(first, count);
      const Eigen::RowVectorXd norms = b.cwiseAbs2().transpose() * at.weight.middleRows(first, count);
      const double gain = products.cwiseAbs2().cwiseQuotient(norms).sum() / floor;
      if (!(gain > least_gain)) continue;
      const Index line = std::clamp(static_cast<Index>((f - band.low) / df), Index{0}, n - 1);
      const Index reach = static_cast<Index>(6 * half_width / df) + 8;
      found.push_back({gain, q, std::max<Index>(0, line - reach), std::min(n - 1, line + reach)});
    }
  }
  found = standing_out(std::move(found), energy, floor, least_gain);
  std::vector<Complex> peaks;
  for (const auto& candidate : found) {
    if (candidate.gain < kSmallest * found.front().gain) break;
    const bool echo = std::any_of(peaks.begin(), peaks.end(), [&](Complex p) {
      const double above = 2 * kPi * band.high;
      const double reach = 12 * std::max(-p.real(), -candidate.pole.real()) + 16 * 2 * kPi * df;
      return (p.imag() > above && candidate.pole.imag() > above) || std::abs(p - candidate.pole) < reach;
    });
    if (!echo) peaks.push_back(candidate.pole);
  }
  return peaks;
}

}  // namespace whirl::modal
