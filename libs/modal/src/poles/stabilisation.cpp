// Poly-reference least-squares complex frequency method, right matrix fraction with complex coefficients per band.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "classic_methods.hpp"
#include "fit/band.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Complex = std::complex<double>;

// Share of the unit circle that the band covers; the rest keeps first and last line apart.
constexpr double kCoverage = 0.93;

// sum_k x_k exp(+j 2 pi k l / M) for l = 0..M-1 (negative lags at the end).
Eigen::VectorXcd lag_sums(const Eigen::VectorXcd& x, Index m) {
  Eigen::VectorXcd padded = Eigen::VectorXcd::Zero(m);
  padded.head(x.size()) = x;
  return signal::inverse_fft(padded) * static_cast<double>(m);
}

// One pole of matrix polynomial `a` (a_n = I) at z, with the participation of the references.
StabilisationPole pole_at(Complex pole, Complex z, int order, const MatrixXcd& a) {
  const Index refs = a.cols();
  StabilisationPole found;
  found.order = order;
  found.pole = pole;
  found.participation = Eigen::VectorXcd::Ones(refs);
  if (refs > 1) {
    MatrixXcd value = MatrixXcd::Identity(refs, refs);
    for (Index r = order - 1; r >= 0; --r) value = (value * z + a.middleRows(r * refs, refs)).eval();
    const Eigen::JacobiSVD<MatrixXcd> svd(value.transpose(), Eigen::ComputeFullV);
    found.participation = svd.matrixV().col(refs - 1);
  }
  return found;
}

// One band: lines [first, first + n) of `band`. Appends the poles of every order that lie in [core_low, core_high) Hz.
//
// Per output o: X = [W z^r], Y = [-W z^r (x) H_o], z = exp(-j theta); R = X^H X, S = X^H Y, T = Y^H Y are block
// Toeplitz: entry (r, s) depends on r - s alone and is an inverse FFT. With R = L L^H and G = L^-1 S, the reduced
// normal matrix of order m is M_m = T - sum_{r <= m} g_r^H g_r on the leading m + 1 blocks: one factorisation serves
// all orders.
void poles_of_band(const Band& band, const Grid& grid, Index first, Index n, double core_low, double core_high,
                   const Orders& orders, double max_damping, std::vector<StabilisationPole>& poles) {
  const Index refs = grid.channel.cols();
  const Index top = orders.high;
  const Index size = refs * (top + 1);
  const Index m = signal::fast_fft_length(static_cast<Index>(std::ceil(static_cast<double>(n) / kCoverage)));
  const double omega0 = band.omega[first];
  const double ts = 2 * kPi / (static_cast<double>(m) * 2 * kPi * band.line_width());

  MatrixXcd reduced = MatrixXcd::Zero(size, size);
  std::vector<MatrixXcd> g;
  for (Index o = 0; o < grid.channel.rows(); ++o) {
    Eigen::VectorXd noise = Eigen::VectorXd::Zero(n);
    for (Index i = 0; i < refs; ++i) {
      noise +=
          band.weight.col(grid.channel(o, i)).segment(first, n).cwiseAbs2().cwiseInverse() / static_cast<double>(refs);
    }
    const Eigen::VectorXcd w2 = noise.cwiseInverse().cast<Complex>();
    const auto at = [m](const Eigen::VectorXcd& sums, Index lag) { return sums[lag < 0 ? lag + m : lag]; };

    const Eigen::VectorXcd r_sums = lag_sums(w2, m);
    MatrixXcd r(top + 1, top + 1);
    for (Index a = 0; a <= top; ++a) {
      for (Index b = 0; b <= top; ++b) r(a, b) = at(r_sums, a - b);
    }
    r.diagonal().array() += 1e-13 * r_sums[0].real();
    MatrixXcd s(top + 1, size);
    for (Index i = 0; i < refs; ++i) {
      const Eigen::VectorXcd hi = band.h.col(grid.channel(o, i)).segment(first, n);
      const Eigen::VectorXcd s_sums = lag_sums(w2.cwiseProduct(hi), m);
      for (Index b = 0; b <= top; ++b) {
        for (Index a = 0; a <= top; ++a) s(a, b * refs + i) = -at(s_sums, a - b);
      }
      for (Index j = i; j < refs; ++j) {
        const Eigen::VectorXcd hj = band.h.col(grid.channel(o, j)).segment(first, n);
        const Eigen::VectorXcd t_sums = lag_sums(w2.cwiseProduct(hi.conjugate()).cwiseProduct(hj), m);
        for (Index b = 0; b <= top; ++b) {
          for (Index a = 0; a <= top; ++a) {
            reduced(a * refs + i, b * refs + j) += at(t_sums, a - b);
            if (j > i) reduced(b * refs + j, a * refs + i) += std::conj(at(t_sums, a - b));
          }
        }
      }
    }
    g.push_back(r.llt().matrixL().solve(s));
  }

  Index done = 0;  // rows of G already subtracted
  for (int order = orders.low; order <= orders.high; order += orders.step) {
    for (const MatrixXcd& rows : g) {
      const MatrixXcd block = rows.middleRows(done, order + 1 - done);
      reduced.noalias() -= block.adjoint() * block;
    }
    done = order + 1;
    const Index q = refs * order;
    MatrixXcd m11 = reduced.topLeftCorner(q, q);
    m11.diagonal().array() += 1e-14 * m11.diagonal().real().mean();
    const MatrixXcd a =
        m11.llt().solve(MatrixXcd(-reduced.block(0, q, q, refs)));  // a_n = I: spurious roots get Re s > 0
    if (!a.allFinite()) continue;
    MatrixXcd companion = MatrixXcd::Zero(q, q);
    companion.topRightCorner(q - refs, q - refs).setIdentity();
    companion.bottomRows(refs) = -a.transpose();
    const Eigen::ComplexEigenSolver<MatrixXcd> eigen(companion, false);
    if (eigen.info() != Eigen::Success) continue;
    for (const Complex z : eigen.eigenvalues()) {
      if (std::abs(z) < 1e-3) continue;
      double angle = -std::arg(z);
      if (angle < -kPi * (1 - kCoverage)) angle += 2 * kPi;
      const Complex pole(-std::log(std::abs(z)) / ts, angle / ts + omega0);
      const double frequency = std::abs(pole) / (2 * kPi);
      if (!(pole.real() < 0) || !(pole.imag() > 0) || frequency < core_low || frequency >= core_high ||
          -pole.real() > max_damping * std::abs(pole)) {
        continue;
      }
      poles.push_back(pole_at(pole, z, order, a));
    }
  }
}

void mark_stable(std::vector<StabilisationPole>& poles, const std::vector<int>& orders, const PoleOptions& options) {
  for (auto& pole : poles) {
    const auto position = std::find(orders.begin(), orders.end(), pole.order);
    // The lowest order has no predecessor: it is compared with the next one.
    const int other = position == orders.begin() ? (orders.size() > 1 ? orders[1] : -1) : *(position - 1);
    double nearest = INFINITY;
    for (const auto& candidate : poles) {
      if (candidate.order != other) continue;
      const double df = std::abs(candidate.frequency() / pole.frequency() - 1) / options.frequency_tolerance;
      const double dz = std::abs(candidate.damping() / pole.damping() - 1) / options.damping_tolerance;
      const bool same_vector = mac(candidate.participation, pole.participation) >= options.min_mac;
      const double distance = df * df + dz * dz + (same_vector ? 0 : 4);
      if (distance >= nearest) continue;
      nearest = distance;
      pole.stable_frequency = df < 1;
      pole.stable_damping = dz < 1;
      pole.stable_vector = same_vector;
    }
  }
}

}  // namespace

double mac(const Eigen::Ref<const Eigen::VectorXcd>& a, const Eigen::Ref<const Eigen::VectorXcd>& b) {
  if (a.size() != b.size() || a.size() == 0) {
    throw Error(fmt::format("MAC of vectors of {} and {} entries: must be equally long", a.size(), b.size()));
  }
  const double norm = a.squaredNorm() * b.squaredNorm();
  return norm > 0 ? std::norm(a.dot(b)) / norm : 0;
}

StabilisationDiagram stabilisation_diagram(const FrequencyResponse& frf, const PoleOptions& options) {
  const Band band = select_band(frf, options.band_low, options.band_high, options.weighting);
  const Grid grid = arrange_grid(frf);
  require_range("max_damping", options.max_damping, 1e-6, 0.999);
  require_range("presence", options.presence, 0.01, 1);
  const Index n = band.lines();

  // Long axes are cut into bands of some 2000 lines: fewer modes each, so lower orders and smaller eigenvalue problems.
  const bool whole = options.method != PoleMethod::plscf;
  const Index bands = whole ? 1 : options.bands > 0 ? options.bands : std::clamp<Index>(n / 2000, 1, 16);
  const Index core = n / bands;
  const Index overlap = bands > 1 ? core / 5 : 0;
  const int most = static_cast<int>(std::max<Index>(2, std::min<Index>(core / 8, 60)));
  Orders orders = options.orders;
  if (orders.high > 0 && 4 * static_cast<Index>(orders.high) > core)
    throw Error(fmt::format("orders.high = {}: must be at most {} for {} lines", orders.high, core / 4, core));
  if (orders.high <= 0) orders.high = std::min(most, whole ? 60 : 32);
  if (orders.low <= 0) orders.low = std::max(2, orders.high / 3);
  if (orders.step <= 0) orders.step = std::max(1, (orders.high - orders.low) / 10);
  if (orders.low > orders.high)
    throw Error(fmt::format("orders.low = {}: must be at most orders.high = {}", orders.low, orders.high));

  StabilisationDiagram diagram;
  diagram.references = grid.references;
  for (int order = orders.low; order <= orders.high; order += orders.step) diagram.orders.push_back(order);
  if (whole) {
    diagram.poles = options.method == PoleMethod::lsce  ? lsce_poles(band, grid, orders, options.max_damping)
                    : options.method == PoleMethod::era ? era_poles(band, grid, orders, options.max_damping)
                                                        : rational_poles(band, grid, orders, options.max_damping);
  }
  for (Index b = 0; b < bands && !whole; ++b) {
    const Index first = std::max<Index>(0, b * core - overlap);
    const Index end = b + 1 == bands ? n : std::min(n, (b + 1) * core + overlap);
    const double low = b == 0 ? band.low : band.low + band.line_width() * static_cast<double>(b * core);
    const double high = b + 1 == bands ? band.high : band.low + band.line_width() * static_cast<double>((b + 1) * core);
    poles_of_band(band, grid, first, end - first, low, high, orders, options.max_damping, diagram.poles);
  }
  std::stable_sort(diagram.poles.begin(), diagram.poles.end(),
                   [](const auto& a, const auto& b) { return a.order < b.order; });
  mark_stable(diagram.poles, diagram.orders, options);
  return diagram;
}

}  // namespace whirl::modal
