// Spectra about a mode as modal forces of unknown covariance behind known poles and shapes, plus noise of unknown
// covariance: y(w) = V H(w) p + b. Both covariances by expectation and maximisation, with the mode and without it.
#include "spectral_evidence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

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
constexpr double kHannLines = 1.5;  // lines that share one degree of freedom behind a Hann window
constexpr Index kBins = 60, kDirections = 6;
constexpr int kEvidenceIterations = 30;

/// Mean of x x^H over a few neighbouring lines.
struct Bin {
  double w, weight;  ///< rad/s; degrees of freedom
  MatrixXcd s;
};

/// Spectra of a record about one mode behind a Hann window, lines x channels.
struct SpectralBand {
  Index first = 0;  ///< line
  double line = 0;  ///< Hz between lines
  MatrixXcd lines;
};

/// Of each mode; every channel is transformed once.
std::vector<SpectralBand> bands_of(const SeenBy& record, const std::vector<OperationalMode>& modes) {
  const MatrixXd& y = *record.y;
  const Index n = y.rows();
  const double line = 1 / (record.dt * static_cast<double>(n));
  std::vector<SpectralBand> bands;
  for (const OperationalMode& m : modes) {
    const double f = m.frequency.value, half = std::max(12 * m.damping.value * f, 40 * line);
    const Index first = std::max<Index>(2, static_cast<Index>((f - half) / line)),
                last = std::min<Index>(n / 2 - 1, static_cast<Index>((f + half) / line));
    bands.push_back({first, line, MatrixXcd(last - first + 1, y.cols())});
  }
  for (Index c = 0; c < y.cols(); ++c) {
    VectorXd x = y.col(c).array() - y.col(c).mean();
    for (Index i = 0; i < n; ++i)
      x[i] *= 1 - std::cos(2 * kPi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
    const VectorXcd spectrum = signal::real_fft(x);
    for (SpectralBand& b : bands) b.lines.col(c) = spectrum.segment(b.first, b.lines.rows());
  }
  return bands;
}

std::vector<Bin> bins_of(const MatrixXcd& lines, Index first, double line) {
  const Index count = lines.rows(), bins = std::min(kBins, count);
  std::vector<Bin> result;
  for (Index b = 0; b < bins; ++b) {
    const Index from = b * count / bins, size = (b + 1) * count / bins - from;
    const MatrixXcd part = lines.middleRows(from, size);
    const double middle = static_cast<double>(first + from) + 0.5 * static_cast<double>(size - 1);
    result.push_back({2 * kPi * line * middle, static_cast<double>(size) / kHannLines,
                      MatrixXcd(part.transpose() * part.conjugate() / static_cast<double>(size))});
  }
  return result;
}

/// Largest log likelihood of the bins, from EM.
double likelihood(const std::vector<Bin>& bins, const VectorXcd& poles, const MatrixXcd& shapes) {
  const Index l = bins.front().s.rows(), m = poles.size();
  double total = 0, result = 0;
  MatrixXcd mean = MatrixXcd::Zero(l, l);
  for (const Bin& bin : bins) {
    mean += bin.weight * bin.s;
    total += bin.weight;
  }
  mean /= total;
  const double floor = 1e-9 * mean.trace().real() / static_cast<double>(l);
  MatrixXcd noise = 0.1 * mean, forces = MatrixXcd::Zero(m, m);
  noise.diagonal().array() += floor;
  for (Index k = 0; k < m; ++k)
    forces(k, k) = 0.5 * mean.trace().real() * std::pow(poles[k].real(), 2) / shapes.col(k).squaredNorm();
  for (int it = 0; it < kEvidenceIterations; ++it) {
    MatrixXcd next_noise = MatrixXcd::Zero(l, l), next_forces = MatrixXcd::Zero(m, m);
    result = 0;
    for (const Bin& bin : bins) {
      MatrixXcd a = shapes;
      for (Index k = 0; k < m; ++k) a.col(k) /= Complex(0, bin.w) - poles[k];
      const MatrixXcd af = a * forces;
      const Eigen::LLT<MatrixXcd> whole(MatrixXcd(af * a.adjoint() + noise));
      const MatrixXcd lower = whole.matrixL();
      const MatrixXcd si = whole.solve(bin.s);
      result -= bin.weight * (2 * lower.diagonal().real().array().log().sum() + si.trace().real());
      // E[x x^H] of a part with gain G = C Sigma^-1: C + G (S - Sigma) G^H.
      const MatrixXcd inverse = whole.solve(MatrixXcd::Identity(l, l));
      const MatrixXcd surplus = si * inverse - inverse;
      next_forces += bin.weight * (forces + af.adjoint() * surplus * af);
      next_noise += bin.weight * (noise + noise * surplus * noise);
    }
    forces = next_forces / total;
    noise = next_noise / total;
    forces = (0.5 * (forces + forces.adjoint())).eval();
    noise = (0.5 * (noise + noise.adjoint())).eval();
    noise.diagonal().array() += floor * 1e-3;
  }
  return result;
}

/// Twice the gain in log likelihood (Whittle's) that `mode` brings to the spectra about its frequency, beside the other
/// modes and even noise.
double spectral_gain(const SeenBy& record, const SpectralBand& band, const std::vector<OperationalMode>& modes,
                     std::size_t index) {
  const MatrixXd& y = *record.y;
  const auto count = static_cast<Index>(modes.size()), mode = static_cast<Index>(index);
  VectorXcd poles(count);
  MatrixXcd shapes(y.cols(), count);
  for (Index k = 0; k < count; ++k) {
    const OperationalMode& one = modes[static_cast<std::size_t>(k)];
    const double w = 2 * kPi * one.frequency.value, zeta = one.damping.value;
    poles[k] = Complex(-zeta * w, w * std::sqrt(1 - zeta * zeta));
    for (Index c = 0; c < y.cols(); ++c)
      shapes(c, k) = one.shape[record.channels[static_cast<std::size_t>(c)]] / record.scale[c];
  }
  // Modes inside and the nearest on either side of them.
  std::vector<Index> near(static_cast<std::size_t>(poles.size()));
  std::iota(near.begin(), near.end(), Index{0});
  const auto distance = [&](Index k) { return k == mode ? 0.0 : std::abs(poles[k] - poles[mode]); };
  std::sort(near.begin(), near.end(), [&](Index a, Index b) { return distance(a) < distance(b); });
  near.resize(std::min<std::size_t>(near.size(), 6));
  // Many channels: the directions of these modes and the strongest others.
  MatrixXcd lines = band.lines;
  MatrixXcd v(y.cols(), static_cast<Index>(near.size()));
  for (Index k = 0; k < v.cols(); ++k) v.col(k) = shapes.col(near[static_cast<std::size_t>(k)]).normalized();
  if (y.cols() > kDirections) {
    const Eigen::SelfAdjointEigenSolver<MatrixXcd> strongest(MatrixXcd(lines.transpose() * lines.conjugate()));
    MatrixXcd basis(y.cols(), kDirections);
    Index have = 0;
    const auto add = [&](VectorXcd direction) {
      if (have == kDirections) return;
      for (int twice = 0; twice < 2; ++twice)
        direction -= basis.leftCols(have) * (basis.leftCols(have).adjoint() * direction);
      if (direction.norm() > 1e-3) basis.col(have++) = direction.normalized();
    };
    for (Index k = 0; k < std::min<Index>(v.cols(), 4); ++k) add(v.col(k));
    for (Index k = y.cols(); k-- > 0;) add(strongest.eigenvectors().col(k));
    lines = (lines * basis.conjugate()).eval();
    v = (basis.adjoint() * v).eval();
  }
  const std::vector<Bin> bins = bins_of(lines, band.first, band.line);
  VectorXcd p(v.cols());
  for (Index k = 0; k < v.cols(); ++k) p[k] = poles[near[static_cast<std::size_t>(k)]];
  VectorXcd others = p.tail(p.size() - 1);
  const MatrixXcd other_shapes = v.rightCols(v.cols() - 1);
  const double with = likelihood(bins, p, v);
  double without = likelihood(bins, others, other_shapes);
  // A second pole laid through a mode mends what is wrong with its first: that one may move before the second (of fewer
  // orders) counts.
  const bool close = others.size() > 0 && modes[static_cast<std::size_t>(near[1])].orders > modes[index].orders &&
                     std::abs(others[0] - p[0]) < 8 * std::max(-p[0].real(), -others[0].real());
  double step = 0.5;
  for (int round = 0; close && round < 8 && 2 * (with - without) < 6 * kChanceGain && step > 0.1; ++round) {
    const Complex start = others[0];
    const double size = step * -start.real();
    Complex best = start;
    for (const Complex move : {Complex(size, 0), Complex(-size, 0), Complex(0, size), Complex(0, -size)}) {
      others[0] = start + move;
      const double moved = likelihood(bins, others, other_shapes);
      if (moved <= without) continue;
      without = moved;
      best = others[0];
    }
    others[0] = best;
    if (best == start) step *= 0.5;
  }
  return 2 * (with - without);
}

}  // namespace

std::string drop_chance_modes(const std::vector<SeenBy>& records, std::size_t orders, OperationalModes& result) {
  int dropped = 0;
  std::vector<std::vector<SpectralBand>> bands;  // of each record, by mode
  for (const SeenBy& record : records) bands.push_back(bands_of(record, result.modes));
  while (!result.modes.empty()) {
    std::size_t least = 0;
    double smallest = INFINITY;
    for (std::size_t k = 0; k < result.modes.size(); ++k) {
      double gain = 0;
      for (std::size_t r = 0; r < records.size(); ++r) gain += spectral_gain(records[r], bands[r][k], result.modes, k);
      gain *= static_cast<double>(result.modes[k].orders) / static_cast<double>(orders);
      if (gain >= smallest) continue;
      smallest = gain;
      least = k;
    }
    if (smallest >= kChanceGain * static_cast<double>(records.size())) break;
    result.modes.erase(result.modes.begin() + static_cast<std::ptrdiff_t>(least));
    for (std::vector<SpectralBand>& b : bands) b.erase(b.begin() + static_cast<std::ptrdiff_t>(least));
    ++dropped;
  }
  if (dropped == 0) return {};
  return fmt::format("; {} further place{} that poles came back to {} no more than chance", dropped,
                     dropped == 1 ? "" : "s", dropped == 1 ? "is" : "are");
}

}  // namespace whirl::modal
