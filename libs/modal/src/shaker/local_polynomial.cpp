#include "local_polynomial.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr Index kOrder = 3;    // coefficients of a polynomial of order two
constexpr Index kFreedom = 4;  // left for the noise

/// Columns w, w r, w r^2 made orthonormal (Gram-Schmidt).
MatrixXd orthonormal_polynomials(const VectorXd& r, const VectorXd& weight) {
  MatrixXd q(r.size(), kOrder);
  for (Index p = 0; p < kOrder; ++p) {
    VectorXd column = weight.array() * r.array().pow(static_cast<double>(p));
    for (int pass = 0; pass < 2; ++pass) column -= q.leftCols(p) * (q.leftCols(p).transpose() * column);
    q.col(p) = column.normalized();
  }
  return q;
}

/// Lines of one step, those of all records one below the other.
struct Lines {
  VectorXd r;             // -1 to 1 over the step
  std::vector<Index> of;  // lines of each record
  MatrixXcd forces, responses;
};

Lines lines_of(const std::vector<LineSpectra>& records, double centre, double width) {
  std::vector<Index> first, count;
  Index all = 0;
  for (const LineSpectra& record : records) {
    const auto begin = static_cast<Index>(std::ceil((centre - width / 2) / record.spacing - 1e-9));
    const auto end =
        std::min(record.forces.rows(), static_cast<Index>(std::ceil((centre + width / 2) / record.spacing - 1e-9)));
    first.push_back(std::max<Index>(0, begin));
    count.push_back(end - first.back() > kOrder ? end - first.back() : 0);
    all += count.back();
  }
  Lines lines;
  lines.r.resize(all);
  lines.forces.resize(all, records.front().forces.cols());
  lines.responses.resize(all, records.front().responses.cols());
  Index at = 0;
  for (std::size_t k = 0; k < records.size(); ++k) {
    const Index m = count[k];
    if (m == 0) continue;
    for (Index i = 0; i < m; ++i)
      lines.r[at + i] = 2 * (static_cast<double>(first[k] + i) * records[k].spacing - centre) / width;
    lines.forces.middleRows(at, m) = records[k].forces.middleRows(first[k], m);
    lines.responses.middleRows(at, m) = records[k].responses.middleRows(first[k], m);
    lines.of.push_back(m);
    at += m;
  }
  return lines;
}

/// Least squares of columns on force times 1, r, r^2, the transients of each record taken off both.
struct Regression {
  MatrixXcd a;             // scaled, without transients
  VectorXd inverse_scale;  // of its columns
  Eigen::LLT<MatrixXcd> llt;
  VectorXd weight;  // of the lines
  const Lines& lines;
  bool solvable = false;

  Regression(const Lines& given, VectorXd weights) : weight(std::move(weights)), lines(given) {
    const Index nu = lines.forces.cols();
    a.resize(lines.r.size(), kOrder * nu);
    for (Index p = 0; p < kOrder; ++p)
      a.middleCols(p * nu, nu) = lines.r.array().pow(static_cast<double>(p)).matrix().asDiagonal() * lines.forces;
    a = without_transients(a);
    const VectorXd scale = a.colwise().norm();
    if (!(scale.size() > 0 && scale.minCoeff() > 0)) return;
    inverse_scale = scale.cwiseInverse();
    a = a * inverse_scale.asDiagonal();
    llt.compute(a.adjoint() * a);
    constexpr double kApart = 1e-4;  // what forces must keep of themselves beside the others
    solvable = llt.info() == Eigen::Success && llt.matrixLLT().diagonal().real().minCoeff() > kApart;
  }
  /// Weighted, without the part of order two in frequency of each record.
  MatrixXcd without_transients(const MatrixXcd& columns) const {
    MatrixXcd rest = weight.asDiagonal() * columns;
    Index at = 0;
    for (const Index m : lines.of) {
      const MatrixXd q = orthonormal_polynomials(lines.r.segment(at, m), weight.segment(at, m));
      rest.middleRows(at, m) -= q * (q.transpose() * rest.middleRows(at, m)).eval();
      at += m;
    }
    return rest;
  }
  /// Coefficients of the forces at the centre; `columns` becomes what is left.
  MatrixXcd solve(MatrixXcd& columns) const {
    const MatrixXcd coefficients = llt.solve(a.adjoint() * columns);
    columns -= a * coefficients;
    return inverse_scale.head(lines.forces.cols()).asDiagonal() * coefficients.topRows(lines.forces.cols());
  }
  /// Variance of each force's coefficient at the centre for unit noise.
  VectorXd leverage() const {
    const MatrixXcd inverse = llt.solve(MatrixXcd::Identity(a.cols(), a.cols()));
    const Index nu = lines.forces.cols();
    return inverse.diagonal().real().head(nu).cwiseProduct(inverse_scale.head(nu).cwiseAbs2());
  }
};

using Denominator = Eigen::Vector2cd;  // 1 + d0 r + d1 r^2

/// The model with one denominator for all responses; false where it does not exist. Responses count by the inverse of
/// `noise`. Errors of the equation are divided by the denominator of the pass before (Sanathanan and Koerner).
bool fit_rational(const Lines& lines, const VectorXd& noise, LocalEstimate& result) {
  const Index ny = lines.responses.cols(), m = lines.r.size();
  const VectorXd scale = noise.cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Denominator d = Denominator::Zero();
  constexpr int kPasses = 4;
  for (int pass = 0; pass < kPasses; ++pass) {
    VectorXd weight(m);
    for (Index i = 0; i < m; ++i) weight[i] = 1 / std::abs(1.0 + lines.r[i] * (d[0] + lines.r[i] * d[1]));
    const Regression regression(lines, weight);
    if (!regression.solvable || !weight.allFinite()) return false;
    MatrixXcd y[3];
    MatrixXcd coefficients[3];
    for (int p = 0; p < 3; ++p) {
      y[p] = regression.without_transients(lines.r.array().pow(p).matrix().asDiagonal() * lines.responses);
      if (p == 0) result.power = y[0].colwise().squaredNorm().transpose();
      coefficients[p] = regression.solve(y[p]);
    }
    Eigen::Matrix2cd gram = Eigen::Matrix2cd::Zero();
    Denominator right = Denominator::Zero();
    for (Index c = 0; c < ny; ++c) {
      Eigen::MatrixX2cd z(m, 2);
      z << y[1].col(c) * scale[c], y[2].col(c) * scale[c];
      gram += z.adjoint() * z;
      right -= z.adjoint() * y[0].col(c) * scale[c];
    }
    const Eigen::Matrix2cd inverse = gram.inverse();
    d = inverse * right;
    if (!d.allFinite() || !inverse.allFinite()) return false;
    if (pass + 1 < kPasses) continue;
    result.value = coefficients[0] + d[0] * coefficients[1] + d[1] * coefficients[2];
    result.left = (y[0] + d[0] * y[1] + d[1] * y[2]).colwise().squaredNorm().transpose();
    result.leverage = regression.leverage().replicate(1, ny);
    for (Index c = 0; c < ny; ++c) {
      for (Index j = 0; j < result.value.rows(); ++j) {
        const Denominator slope(coefficients[1](j, c), coefficients[2](j, c));
        result.leverage(j, c) += (slope.transpose() * inverse * slope.conjugate()).value().real() * scale[c] * scale[c];
      }
    }
  }
  result.freedom -= 2.0 / static_cast<double>(ny);
  return true;
}

}  // namespace

Index least_lines(Index forces, std::size_t records) {
  return kOrder * (forces + static_cast<Index>(records)) + kFreedom;
}

LocalEstimate local_polynomial(const std::vector<LineSpectra>& records, double centre, double width) {
  const Lines lines = lines_of(records, centre, width);
  const Index nu = records.front().forces.cols(), ny = records.front().responses.cols();
  LocalEstimate result;
  result.power = VectorXd::Zero(ny);
  result.force_power = VectorXd::Zero(nu);
  result.given_power = lines.forces.colwise().squaredNorm().transpose();
  result.lines = static_cast<double>(lines.r.size() - kOrder * static_cast<Index>(lines.of.size()));
  result.freedom = result.lines - static_cast<double>(kOrder * nu);
  const Regression regression(lines, VectorXd::Ones(lines.r.size()));
  if (result.lines > 0)
    result.force_power = regression.without_transients(lines.forces).colwise().squaredNorm().transpose();
  if (result.freedom < 1 || !regression.solvable) return result;
  MatrixXcd y = regression.without_transients(lines.responses);
  result.power = y.colwise().squaredNorm().transpose();
  result.value = regression.solve(y);
  result.left = y.colwise().squaredNorm().transpose();
  result.leverage = regression.leverage().replicate(1, ny);
  result.solved = true;
  const double freedom = static_cast<double>(ny) * result.freedom - 2;
  if (freedom < 2) return result;
  LocalEstimate rational = result;
  if (!fit_rational(lines, result.left / result.freedom, rational)) return result;
  const VectorXd ratio = rational.left.cwiseQuotient(result.left.cwiseMax(1e-300));
  constexpr double kBetter = 3;
  return ratio.sum() / rational.freedom * kBetter < static_cast<double>(ny) / result.freedom ? rational : result;
}

TransientEstimate transient_at(const MatrixXcd& responses, Index k, Index periods) {
  constexpr Index kSide = 5;  // lines on either side
  std::vector<Index> lines;
  for (const Index side : {Index{-1}, Index{1}}) {
    Index taken = 0;
    for (Index i = k + side; i > 0 && i < responses.rows() && taken < kSide; i += side) {
      if (i % periods == 0) continue;
      lines.push_back(i);
      ++taken;
    }
  }
  const auto m = static_cast<Index>(lines.size());
  TransientEstimate result;
  result.freedom = static_cast<double>(m - kOrder);
  if (result.freedom < 1) return result;
  MatrixXd v(m, kOrder);
  MatrixXcd y(m, responses.cols());
  for (Index i = 0; i < m; ++i) {
    const Index line = lines[static_cast<std::size_t>(i)];
    const double r = static_cast<double>(line - k) / static_cast<double>(2 * kSide);
    v.row(i) << 1, r, r * r;
    y.row(i) = responses.row(line);
  }
  const MatrixXd inverse = MatrixXd(v.transpose() * v).llt().solve(MatrixXd(MatrixXd::Identity(kOrder, kOrder)));
  const MatrixXcd coefficients = inverse * (v.transpose() * y);
  result.left = (y - v * coefficients).colwise().squaredNorm().transpose();
  result.leverage = inverse(0, 0);
  result.value = coefficients.row(0).transpose();
  return result;
}

}  // namespace whirl::modal
