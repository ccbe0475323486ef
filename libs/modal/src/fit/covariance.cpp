#include <algorithm>
#include <cmath>

#include "fractions.hpp"
#include "whirl/core/decompositions.hpp"
#include "white_fit.hpp"

namespace whirl::modal {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

MatrixXd inverse_of(const MatrixXd& information) {
  const VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  scaled.diagonal().array() += 1e-12;
  const MatrixXd inverse = scaled.ldlt().solve(MatrixXd(MatrixXd::Identity(scaled.rows(), scaled.cols())));
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

// Columns of all modes and residual terms on some lines, and the derivatives per half width, residues left out.
void fill_columns(const Band& band, const Poles& poles, const ResidualTerms& terms, Index first, Index lines,
                  MatrixXcd& columns, MatrixXcd& derivatives) {
  const auto n = static_cast<Index>(poles.size());
  const std::vector<Roots> roots = roots_of(band, poles, terms);
  MatrixXd rows(lines, 8 * n);
  fill_fractions(band, roots, first, lines, true, rows);
  const Eigen::VectorXcd factor = motion_factor(band, first, lines);
  columns.resize(lines, 2 * n + terms.count());
  derivatives.resize(lines, 2 * n);
  for (Index k = 0; k < n; ++k) {
    const double width = -roots[static_cast<std::size_t>(k)].first.real();
    for (const bool derivative : {false, true}) {
      const Index at = 4 * k + (derivative ? 2 : 0);
      const Eigen::VectorXcd u = rows.col(at).cast<Complex>() + kJ * rows.col(4 * n + at).cast<Complex>();
      const Eigen::VectorXcd v = rows.col(at + 1).cast<Complex>() + kJ * rows.col(4 * n + at + 1).cast<Complex>();
      const Pairing pairing = pairing_of(terms, derivative);
      MatrixXcd& to = derivative ? derivatives : columns;
      to.col(2 * k) = (derivative ? width : 1.0) * (u + pairing.alpha * v);
      to.col(2 * k + 1) = (derivative ? width : 1.0) * kJ * (u + pairing.beta * v);
    }
  }
  const MatrixXcd tail = residual_terms(band, terms, first, lines);
  for (Index t = 0; t < tail.cols(); ++t) {
    const Index step = terms.complex ? 2 : 1;
    columns.col(2 * n + step * t) = tail.col(t);
    if (terms.complex) columns.col(2 * n + step * t + 1) = kJ * tail.col(t);
  }
  columns = factor.asDiagonal() * columns;
  derivatives = factor.asDiagonal() * derivatives;
}

}  // namespace

MatrixXd covariance_of(const Band& band, const Refined& state, const ResidualTerms& terms, double correlated) {
  const MatrixXd slopes = tie_slopes(state.poles.size(), state.ties);
  return correlated * state.fit.total() / freedom(band, state.poles, terms) *
         inverse_of(slopes.transpose() * state.fit.jtj * slopes);
}

MatrixXd line_covariance(const Band& band, const Refined& state, const ResidualTerms& terms, double correlated) {
  const auto n = static_cast<Index>(state.poles.size());
  const auto block = static_cast<Index>(std::ceil(correlated));
  MatrixXd meat = MatrixXd::Zero(2 * n, 2 * n);
  VectorXd sum = VectorXd::Zero(2 * n);
  MatrixXcd columns, derivatives;
  const std::vector<Roots> roots = roots_of(band, state.poles, terms);
  for (Index first = 0; first < band.lines(); first += kSlice) {
    const Index lines = std::min(kSlice, band.lines() - first);
    fill_columns(band, state.poles, terms, first, lines, columns, derivatives);
    MatrixXd scores = MatrixXd::Zero(lines, 2 * n);
    MatrixXcd left;
    for (Index c = 0; c < band.channels(); ++c) {
      const auto group = static_cast<std::size_t>(state.fit.projection.size() == 1 ? 0 : c);
      if (c == 0 || state.fit.projection.size() > 1)
        left = derivatives - columns * state.fit.projection[group].cast<Complex>();
      const Eigen::VectorXcd data =
          state.residual.col(c)
              .segment(first, lines)
              .cwiseProduct(band.weight.col(c).segment(first, lines).cwiseAbs2().cast<Complex>());
      const MatrixXd products = (left.conjugate().array().colwise() * data.array()).real();
      for (Index k = 0; k < n; ++k) {
        const double a = state.fit.residues(2 * k, c), b = state.fit.residues(2 * k + 1, c);
        const double width = -roots[static_cast<std::size_t>(k)].first.real();
        scores.col(2 * k) += (a * products.col(2 * k) + b * products.col(2 * k + 1)) / width;
        scores.col(2 * k + 1) += (a * products.col(2 * k + 1) - b * products.col(2 * k)) / width;
      }
    }
    for (Index i = 0; i < lines; ++i) {
      sum += scores.row(i).transpose();
      if ((first + i + 1) % block == 0 || first + i + 1 == band.lines()) {
        meat.selfadjointView<Eigen::Lower>().rankUpdate(sum);
        sum.setZero();
      }
    }
  }
  const MatrixXd slopes = tie_slopes(state.poles.size(), state.ties);
  const MatrixXd bread = inverse_of(slopes.transpose() * state.fit.jtj * slopes);
  meat = slopes.transpose() * MatrixXd(meat.selfadjointView<Eigen::Lower>()) * slopes;
  const double data = static_cast<double>(2 * band.h.size());
  return data / freedom(band, state.poles, terms) * (bread * meat * bread);
}

}  // namespace whirl::modal
