#include "classic_methods.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

// Impulse responses of the band shifted to 0 Hz: one block (outputs x references) per sample, side by side. Lines at
// positive frequencies only make them complex, with one pole z = exp((p - j w0) dt) per mode.
struct Impulse {
  MatrixXcd blocks;  ///< outputs x (references * samples)
  Index outputs = 0, references = 0, samples = 0;
  double dt = 0, omega0 = 0;

  auto block(Index n) const { return blocks.middleCols(n * references, references); }
};

Impulse impulse_of(const Band& band, const Grid& grid) {
  Impulse h;
  h.outputs = grid.channel.rows();
  h.references = grid.channel.cols();
  const Index lines = band.lines();
  h.samples = lines / 2;  // the second half holds noise and what the ends of the band wrapped around
  h.dt = 1 / (static_cast<double>(lines) * band.line_width());
  h.omega0 = band.omega[0];
  h.blocks.resize(h.outputs, h.references * h.samples);
  for (Index o = 0; o < h.outputs; ++o) {
    for (Index i = 0; i < h.references; ++i) {
      const Index c = grid.channel(o, i);
      const VectorXcd response =
          signal::inverse_fft(band.h.col(c) * (std::sqrt(static_cast<double>(lines)) / band.h.col(c).norm()));
      for (Index n = 0; n < h.samples; ++n) h.blocks(o, n * h.references + i) = response[n];
    }
  }
  return h;
}

void keep(std::vector<StabilisationPole>& poles, const Band& band, int order, Complex pole,
          const VectorXcd& participation, double max_damping) {
  const double f = std::abs(pole) / (2 * kPi);
  if (!(pole.real() < 0) || !(pole.imag() > 0) || f < band.low || f > band.high ||
      -pole.real() > max_damping * std::abs(pole))
    return;
  StabilisationPole found;
  found.order = order;
  found.pole = pole;
  found.participation = participation.normalized();
  poles.push_back(std::move(found));
}

}  // namespace

// sum_{r=0..n} h(t + r) A_r = 0 with A_n = I, least squares over outputs and times; one Gram matrix for all orders.
std::vector<StabilisationPole> lsce_poles(const Band& band, const Grid& grid, const Orders& orders,
                                          double max_damping) {
  const Impulse h = impulse_of(band, grid);
  const Index refs = h.references, size = refs * (orders.high + 1);
  const Index times = std::min<Index>(h.samples - orders.high, 20 * orders.high);
  MatrixXcd gram = MatrixXcd::Zero(size, size);
  for (Index t = 1; t < times; ++t) {  // sample 0 holds the residuals
    const auto row = h.blocks.middleCols(t * refs, size);
    gram.noalias() += row.adjoint() * row;
  }
  std::vector<StabilisationPole> poles;
  for (int order = orders.low; order <= orders.high; order += orders.step) {
    const Index q = refs * order;
    MatrixXcd m11 = gram.topLeftCorner(q, q);
    m11.diagonal().array() += 1e-14 * m11.diagonal().real().mean();
    const MatrixXcd a = m11.llt().solve(MatrixXcd(-gram.block(0, q, q, refs)));
    if (!a.allFinite()) continue;
    MatrixXcd companion = MatrixXcd::Zero(q, q);
    companion.topRightCorner(q - refs, q - refs).setIdentity();
    companion.bottomRows(refs) = -a.transpose();
    const Eigen::ComplexEigenSolver<MatrixXcd> eigen(companion);
    if (eigen.info() != Eigen::Success) continue;
    for (Index k = 0; k < q; ++k) {
      const Complex z = eigen.eigenvalues()[k];
      if (std::abs(z) < 1e-3) continue;
      double angle = std::arg(z);
      if (angle < -0.05 * kPi) angle += 2 * kPi;
      keep(poles, band, order, Complex(std::log(std::abs(z)), angle) / h.dt + Complex(0, h.omega0),
           eigen.eigenvectors().col(k).head(refs), max_damping);
    }
  }
  return poles;
}

// Hankel matrix of the impulse responses, H0 = U S V^H; A = S^-1/2 U^H H1 V S^-1/2 for each order.
std::vector<StabilisationPole> era_poles(const Band& band, const Grid& grid, const Orders& orders, double max_damping) {
  const Impulse h = impulse_of(band, grid);
  // Blocks enough for the highest order with room; more cost as their cube.
  const Index columns = std::min<Index>(h.samples / 2 - 2, 2 * orders.high),
              rows = std::min<Index>(h.samples / 2 - 2, 3 * orders.high);
  MatrixXcd h0(rows * h.outputs, columns * h.references), h1 = h0;
  for (Index r = 0; r < rows; ++r) {
    for (Index c = 0; c < columns; ++c) {
      h0.block(r * h.outputs, c * h.references, h.outputs, h.references) = h.block(r + c + 1);
      h1.block(r * h.outputs, c * h.references, h.outputs, h.references) = h.block(r + c + 2);
    }
  }
  const Eigen::BDCSVD<MatrixXcd> svd(h0, Eigen::ComputeThinU | Eigen::ComputeThinV);
  std::vector<StabilisationPole> poles;
  for (int order = orders.low; order <= orders.high; order += orders.step) {
    const Index n = std::min<Index>(order, svd.singularValues().size());
    const Eigen::VectorXd scale = svd.singularValues().head(n).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const MatrixXcd a = scale.asDiagonal() * (svd.matrixU().leftCols(n).adjoint() * h1 * svd.matrixV().leftCols(n)) *
                        scale.asDiagonal();
    const Eigen::ComplexEigenSolver<MatrixXcd> eigen(a);
    if (eigen.info() != Eigen::Success) continue;
    // Input matrix in modal coordinates: participation of the references.
    const MatrixXcd b = svd.singularValues().head(n).cwiseSqrt().asDiagonal() *
                        svd.matrixV().leftCols(n).adjoint().leftCols(h.references);
    const MatrixXcd modal = eigen.eigenvectors().partialPivLu().solve(b);
    for (Index k = 0; k < n; ++k) {
      const Complex z = eigen.eigenvalues()[k];
      if (std::abs(z) < 1e-3) continue;
      double angle = std::arg(z);
      if (angle < -0.05 * kPi) angle += 2 * kPi;
      keep(poles, band, order, Complex(std::log(std::abs(z)), angle) / h.dt + Complex(0, h.omega0),
           modal.row(k).transpose(), max_damping);
    }
  }
  return poles;
}

// H = P/D with P and D in polynomials of s that are orthonormal over the lines: P under the weight W, D under W |H|.
// Both come from Arnoldi iterations with s; the Hessenberg matrix of D's gives the roots without powers of s.
std::vector<StabilisationPole> rational_poles(const Band& band, const Grid& grid, const Orders& orders,
                                              double max_damping) {
  const Index lines = band.lines(), top = orders.high;
  const double centre = 0.5 * (band.omega[0] + band.omega[lines - 1]),
               half = 0.5 * (band.omega[lines - 1] - band.omega[0]);
  const VectorXcd x = Complex(0, 1) * ((band.omega.array() - centre) / half).matrix().cast<Complex>();
  const auto arnoldi = [&](const Eigen::VectorXd& weight, MatrixXcd& q, MatrixXcd& hessenberg) {
    q.resize(lines, top + 1);
    hessenberg = MatrixXcd::Zero(top + 1, top);
    q.col(0) = (weight / weight.norm()).cast<Complex>();
    for (Index k = 0; k < top; ++k) {
      VectorXcd v = x.cwiseProduct(q.col(k));
      for (int twice = 0; twice < 2; ++twice) {
        const VectorXcd projection = q.leftCols(k + 1).adjoint() * v;
        v -= q.leftCols(k + 1) * projection;
        hessenberg.col(k).head(k + 1) += projection;
      }
      hessenberg(k + 1, k) = v.norm();
      q.col(k + 1) = v / v.norm();
    }
  };
  const Eigen::VectorXd sum = band.h.cwiseProduct(band.weight.cast<Complex>()).rowwise().norm();
  MatrixXcd denominator, roots, reduced = MatrixXcd::Identity(top + 1, top + 1);
  arnoldi(sum, denominator, roots);
  std::vector<MatrixXcd> g;
  for (Index o = 0; o < grid.channel.rows(); ++o) {
    for (Index i = 0; i < grid.channel.cols(); ++i) {
      const Index c = grid.channel(o, i);
      MatrixXcd numerator, unused;
      arnoldi(band.weight.col(c), numerator, unused);
      const VectorXcd ratio = band.h.col(c).cwiseProduct((band.weight.col(c).cwiseQuotient(sum)).cast<Complex>());
      g.push_back(numerator.adjoint() * (ratio.asDiagonal() * denominator));
    }
  }
  std::vector<StabilisationPole> poles;
  Index done = 0;
  for (int order = orders.low; order <= orders.high; order += orders.step) {
    for (const MatrixXcd& rows : g)
      reduced -= rows.middleRows(done, order + 1 - done).adjoint() * rows.middleRows(done, order + 1 - done);
    done = order + 1;
    MatrixXcd m11 = reduced.topLeftCorner(order, order);
    m11.diagonal().array() += 1e-14;
    const VectorXcd c = m11.llt().solve(
        Eigen::VectorXcd(-reduced.col(order).head(order)));  // of the lower polynomials; the highest has 1
    if (!c.allFinite()) continue;
    MatrixXcd comrade = roots.topLeftCorner(order, order);
    comrade.col(order - 1) -= roots(order, order - 1) * c;
    const Eigen::ComplexEigenSolver<MatrixXcd> eigen(comrade, false);
    if (eigen.info() != Eigen::Success) continue;
    for (const Complex root : eigen.eigenvalues()) {
      keep(poles, band, order, root * half + Complex(0, centre), VectorXcd::Ones(1), max_damping);
    }
  }
  return poles;
}

}  // namespace whirl::modal
