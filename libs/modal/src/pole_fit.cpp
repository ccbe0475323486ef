// Variable projection. With columns Phi (pole pairs and residual terms) and their pole derivatives Psi, everything the
// Gauss-Newton step needs follows from the Gram matrix of [Phi Psi] and its products with the data; the rows of the
// problem are formed in slices that stay in the cache and are never stored.
#include "pole_fit.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace whirl {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr Index kSlice = 256;  // lines

// Complex columns as separate real and imaginary halves: rows [0, n) real, [n, 2n) imaginary.
class Columns {
 public:
  Columns(const Band& band, const Poles& poles, const ResidualTerms& terms, bool derivatives)
      : band_(band), poles_(poles), terms_(terms), derivatives_(derivatives) {}

  Index linear() const { return 2 * static_cast<Index>(poles_.size()) + terms_.count(); }
  Index count() const { return linear() + (derivatives_ ? 2 * static_cast<Index>(poles_.size()) : 0); }

  // Fills lines [first, first + n) into the top 2n rows of `rows`.
  void fill(Index first, Index n, Eigen::Ref<MatrixXd> rows) const {
    const ArrayXd w = band_.omega.segment(first, n).array();
    Index column = 0;
    for (const Complex p : poles_) {
      const double re = band_.decay - p.real();
      const ArrayXd d1 = w - p.imag(), d2 = w + p.imag();
      const ArrayXd n1 = (d1.square() + re * re).inverse(), n2 = (d2.square() + re * re).inverse();
      // u = 1/(s - p), v = 1/(s - p*)
      const ArrayXd ur = re * n1, ui = -d1 * n1, vr = re * n2, vi = -d2 * n2;
      put(rows, column++, n, w, ur + vr, ui + vi);
      put(rows, column++, n, w, vi - ui, ur - vr);  // j (u - v)
      if (derivatives_) {
        // Per half width of change, so that every column has the size of a pole term.
        const double scale = half_width(p);
        const ArrayXd u2r = scale * (ur.square() - ui.square()), u2i = 2 * scale * ur * ui;
        const ArrayXd v2r = scale * (vr.square() - vi.square()), v2i = 2 * scale * vr * vi;
        const Index derivative = linear() + column - 2;
        put(rows, derivative, n, w, u2r + v2r, u2i + v2i);
        put(rows, derivative + 1, n, w, v2i - u2i, u2r - v2r);
      }
    }
    // Frequencies relative to the end of the band keep the residual columns comparable.
    const double top = band_.omega[band_.lines() - 1];
    const ArrayXd zero = ArrayXd::Zero(n);
    const ArrayXd sr = (band_.decay * band_.decay - w.square()) / (top * top), si = 2 * band_.decay / (top * top) * w;
    const ArrayXd norm = (sr.square() + si.square()).inverse();
    const auto term = [&](const ArrayXd& re, const ArrayXd& im) {
      put(rows, column++, n, w, re, im);
      if (terms_.complex) put(rows, column++, n, w, -im, re);
    };
    if (terms_.lower) term(sr * norm, -si * norm);
    if (terms_.upper) term(ArrayXd::Ones(n), zero);
    if (terms_.slope) term(sr, si);
  }

  // Half width of the peak as seen, rad/s.
  double half_width(Complex p) const { return band_.decay - p.real(); }

 private:
  // Multiplies by s^d, s = decay + j w, and stores.
  void put(Eigen::Ref<MatrixXd> rows, Index column, Index n, const ArrayXd& w, const ArrayXd& re, const ArrayXd& im) const {
    const double decay = band_.decay;
    ArrayXd fr = re, fi = im;
    for (int i = 0; i < band_.power; ++i) {
      const ArrayXd next = decay * fr - w * fi;
      fi = decay * fi + w * fr;
      fr = next;
    }
    rows.col(column).head(n) = fr.matrix();
    rows.col(column).segment(n, n) = fi.matrix();
  }

  const Band& band_;
  const Poles& poles_;
  const ResidualTerms& terms_;
  bool derivatives_;
};

struct Normal {
  MatrixXd gram;  ///< of all columns, lower triangle
  MatrixXd data;  ///< columns^T data, one column per channel of the group
};

// Normal equations of the channels [channel, channel + group) which share the weights of the first, up to a factor.
Normal accumulate(const Band& band, const Columns& columns, Index channel, Index group) {
  const Index k = columns.count();
  Normal normal{MatrixXd::Zero(k, k), MatrixXd::Zero(k, group)};
  MatrixXd rows(2 * kSlice, k);
  MatrixXd data(2 * kSlice, group);
  for (Index first = 0; first < band.lines(); first += kSlice) {
    const Index n = std::min(kSlice, band.lines() - first);
    columns.fill(first, n, rows);
    VectorXd w(2 * n);
    w << band.weight.col(channel).segment(first, n), band.weight.col(channel).segment(first, n);
    rows.topRows(2 * n).array().colwise() *= w.array();
    for (Index c = 0; c < group; ++c) {
      const double factor = band.weight(first, channel + c) / band.weight(first, channel);
      data.col(c).head(n) = factor * band.h.col(channel + c).segment(first, n).real();
      data.col(c).segment(n, n) = factor * band.h.col(channel + c).segment(first, n).imag();
    }
    data.topRows(2 * n).array().colwise() *= w.array();
    normal.gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.topRows(2 * n).transpose());
    normal.data.noalias() += rows.topRows(2 * n).transpose() * data.topRows(2 * n);
  }
  normal.gram.triangularView<Eigen::StrictlyUpper>() = normal.gram.transpose();
  return normal;
}

}  // namespace

PoleFit fit_poles(const Band& band, const Poles& poles, const ResidualTerms& terms, bool with_jacobian) {
  const Columns columns(band, poles, terms, with_jacobian);
  const auto n = static_cast<Index>(poles.size());
  const Index m = columns.linear();
  PoleFit fit;
  fit.residues.resize(m, band.channels());
  fit.cost.resize(band.channels());
  fit.rise = VectorXd::Zero(n);
  if (with_jacobian) {
    fit.jtj = MatrixXd::Zero(2 * n, 2 * n);
    fit.jtr = VectorXd::Zero(2 * n);
  }
  const Index group = band.common_weight ? band.channels() : 1;
  for (Index first = 0; first < band.channels(); first += group) {
    const Normal normal = accumulate(band, columns, first, group);
    // Columns scaled to unit length; the small ridge only matters when poles coincide.
    const VectorXd scale = normal.gram.diagonal().head(m).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    MatrixXd g11 = scale.asDiagonal() * normal.gram.topLeftCorner(m, m) * scale.asDiagonal();
    g11.diagonal().array() += 1e-13;
    const Eigen::LLT<MatrixXd> factor(g11);
    const MatrixXd x = scale.asDiagonal() * factor.solve(scale.asDiagonal() * normal.data.topRows(m));
    const MatrixXd inverse = factor.solve(MatrixXd::Identity(m, m));

    MatrixXd schur, psi_r;
    if (with_jacobian && n > 0) {
      const MatrixXd g12 = scale.asDiagonal() * normal.gram.topRightCorner(m, 2 * n);
      schur = normal.gram.bottomRightCorner(2 * n, 2 * n) - g12.transpose() * factor.solve(g12);
      psi_r = normal.data.bottomRows(2 * n) - normal.gram.bottomLeftCorner(2 * n, m) * x;
    }
    for (Index c = 0; c < group; ++c) {
      const Index channel = first + c;
      // Data of this channel entered as (its weight) * h, columns as (first weight): residues refer to h itself.
      const double factor_c = band.weight(0, channel) / band.weight(0, first);
      fit.residues.col(channel) = x.col(c) / factor_c;
      fit.cost[channel] = band.h.col(channel).cwiseAbs2().dot(band.weight.col(channel).cwiseAbs2()) -
                          normal.data.col(c).head(m).dot(x.col(c));
      for (Index k = 0; k < n; ++k) {
        const Eigen::Vector2d a = x.col(c).segment<2>(2 * k).cwiseQuotient(scale.segment<2>(2 * k));
        fit.rise[k] += a.dot(inverse.block<2, 2>(2 * k, 2 * k).inverse() * a);
      }
      if (!with_jacobian) continue;
      // dh/dRe p = a psi1 + b psi2, dh/dIm p = a psi2 - b psi1 for the residue a + j b.
      const auto rotate = [&](Index k) {
        Eigen::Matrix2d r;
        const double a = x(2 * k, c), b = x(2 * k + 1, c);
        r << a, -b, b, a;
        return r;
      };
      for (Index k = 0; k < n; ++k) {
        const Eigen::Matrix2d rk = rotate(k);
        fit.jtr.segment<2>(2 * k) += rk.transpose() * psi_r.col(c).segment<2>(2 * k);
        for (Index l = 0; l <= k; ++l) {
          fit.jtj.block<2, 2>(2 * k, 2 * l) += rk.transpose() * schur.block<2, 2>(2 * k, 2 * l) * rotate(l);
        }
      }
    }
  }
  if (with_jacobian) {
    fit.jtj.triangularView<Eigen::StrictlyUpper>() = fit.jtj.transpose();
    // Back from half widths to rad/s.
    VectorXd unit(2 * n);
    for (Index k = 0; k < n; ++k) unit.segment<2>(2 * k).setConstant(1 / columns.half_width(poles[static_cast<std::size_t>(k)]));
    fit.jtj = unit.asDiagonal() * fit.jtj * unit.asDiagonal();
    fit.jtr = unit.asDiagonal() * fit.jtr;
  }
  return fit;
}

Eigen::MatrixXcd residual_of(const Band& band, const Poles& poles, const ResidualTerms& terms, const PoleFit& fit) {
  const Columns columns(band, poles, terms, false);
  Eigen::MatrixXcd residual = band.h;
  MatrixXd rows(2 * kSlice, columns.count());
  for (Index first = 0; first < band.lines(); first += kSlice) {
    const Index n = std::min(kSlice, band.lines() - first);
    columns.fill(first, n, rows);
    const MatrixXd model = rows.topRows(2 * n) * fit.residues;
    residual.middleRows(first, n).real() -= model.topRows(n);
    residual.middleRows(first, n).imag() -= model.bottomRows(n);
  }
  return residual;
}

}  // namespace whirl
