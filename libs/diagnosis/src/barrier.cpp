#include "barrier.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "whirl/core/decompositions.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

/// The cone program in real form, scaled: columns of A have norm 1, the largest reading is 1. x = (re w, im w, t).
struct ConeProgram {
  Eigen::MatrixXcd a;
  Eigen::VectorXcd v;
  Eigen::VectorXd limit;
  std::vector<std::pair<Index, Index>> groups;  ///< first row, rows

  Index planes() const { return a.cols(); }
  double degree() const {
    return 2.0 * (static_cast<double>(groups.size()) + static_cast<double>(limit.array().isFinite().count()));
  }
  Eigen::VectorXcd masses(const Eigen::VectorXd& x) const {
    Eigen::VectorXcd w(planes());
    for (Index p = 0; p < planes(); ++p) w[p] = {x[p], x[planes() + p]};
    return w;
  }

  /// tau t - sum log(t^2 - |r|^2) - sum log(limit^2 - |w|^2); infinity outside.
  double value(const Eigen::VectorXd& x, double tau) const {
    const double t = x[2 * planes()];
    const Eigen::VectorXcd w = masses(x), r = v + a * w;
    double f = tau * t;
    for (const auto& [first, count] : groups) {
      const double phi = t * t - r.segment(first, count).squaredNorm();
      if (!(phi > 0) || t <= 0) return std::numeric_limits<double>::infinity();
      f -= std::log(phi);
    }
    for (Index p = 0; p < planes(); ++p) {
      if (!std::isfinite(limit[p])) continue;
      const double phi = limit[p] * limit[p] - std::norm(w[p]);
      if (!(phi > 0)) return std::numeric_limits<double>::infinity();
      f -= std::log(phi);
    }
    return f;
  }

  void derivatives(const Eigen::VectorXd& x, double tau, Eigen::VectorXd& g, Eigen::MatrixXd& h) const {
    const Index n = planes(), size = 2 * n + 1;
    const double t = x[2 * n];
    const Eigen::VectorXcd w = masses(x), r = v + a * w;
    g = Eigen::VectorXd::Zero(size);
    g[2 * n] = tau;
    h = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd slope(size);
    for (const auto& [first, count] : groups) {
      const auto block = a.middleRows(first, count);
      const double phi = t * t - r.segment(first, count).squaredNorm();
      const Eigen::VectorXcd b = block.adjoint() * r.segment(first, count);
      slope << -2 * b.real(), -2 * b.imag(), 2 * t;
      const Eigen::MatrixXcd gram = block.adjoint() * block;
      g -= slope / phi;
      h += slope * slope.transpose() / (phi * phi);
      h.topLeftCorner(n, n) += 2 / phi * gram.real();
      h.block(n, n, n, n) += 2 / phi * gram.real();
      h.block(0, n, n, n) -= 2 / phi * gram.imag();
      h.block(n, 0, n, n) += 2 / phi * gram.imag();
      h(2 * n, 2 * n) -= 2 / phi;
    }
    for (Index p = 0; p < n; ++p) {
      if (!std::isfinite(limit[p])) continue;
      const double phi = limit[p] * limit[p] - std::norm(w[p]);
      const double re = 2 * w[p].real() / phi, im = 2 * w[p].imag() / phi;
      g[p] += re;
      g[n + p] += im;
      h(p, p) += re * re + 2 / phi;
      h(n + p, n + p) += im * im + 2 / phi;
      h(p, n + p) += re * im;
      h(n + p, p) += re * im;
    }
  }

  void centre(Eigen::VectorXd& x, double tau) const {
    Eigen::VectorXd g;
    Eigen::MatrixXd h;
    for (int iteration = 0; iteration < 60; ++iteration) {
      derivatives(x, tau, g, h);
      const Eigen::VectorXd step = -h.ldlt().solve(g);
      const double decrement = -g.dot(step);
      if (!std::isfinite(decrement) || decrement < 1e-12) return;
      const double f = value(x, tau);
      double length = 1;
      while (length > 1e-12 && !(value(x + length * step, tau) <= f - 0.1 * length * decrement)) length *= 0.5;
      if (length <= 1e-12) return;
      x += length * step;
    }
  }

  /// For any u with sum of group norms 1: t >= Re u^H v - sum limit |A^H u|, where A^H u must vanish on planes without
  /// a limit: u from the barrier, those planes projected out.
  double bound(const Eigen::VectorXd& x) const {
    const double t = x[2 * planes()];
    const Eigen::VectorXcd w = masses(x);
    Eigen::VectorXcd u = v + a * w;
    for (const auto& [first, count] : groups) u.segment(first, count) /= t * t - u.segment(first, count).squaredNorm();
    std::vector<Index> open;
    for (Index p = 0; p < planes(); ++p)
      if (!std::isfinite(limit[p])) open.push_back(p);
    if (!open.empty()) {
      Eigen::MatrixXcd free(a.rows(), static_cast<Index>(open.size()));
      for (std::size_t k = 0; k < open.size(); ++k) free.col(static_cast<Index>(k)) = a.col(open[k]);
      const auto qr = free.completeOrthogonalDecomposition();
      for (int pass = 0; pass < 2; ++pass) u -= free * qr.solve(u);
    }
    double norm = 0;
    for (const auto& [first, count] : groups) norm += u.segment(first, count).norm();
    double lower = u.dot(v).real();
    const Eigen::VectorXcd pull = a.adjoint() * u;
    for (Index p = 0; p < planes(); ++p)
      if (std::isfinite(limit[p])) lower -= limit[p] * std::abs(pull[p]);
    return norm > 0 ? lower / norm : 0;
  }
};

}  // namespace

BarrierResult minimise_cones(const Eigen::MatrixXcd& a, const Eigen::VectorXcd& v, const Eigen::VectorXd& limit,
                             bool rowwise) {
  const Index n = a.cols();
  const double scale = v.cwiseAbs().maxCoeff();
  BarrierResult result;
  result.masses = Eigen::VectorXcd::Zero(n);
  if (scale == 0) return result;
  Eigen::VectorXd column(n);
  for (Index p = 0; p < n; ++p) column[p] = a.col(p).norm() > 0 ? a.col(p).norm() : 1;
  ConeProgram program;
  program.a = a * column.cwiseInverse().asDiagonal();
  program.v = v / scale;
  // A plane that may carry nothing has no inside: it gets a limit that no balance can see.
  program.limit = (limit.array() * column.array() / scale).max(1e-9).matrix();
  if (rowwise)
    for (Index m = 0; m < a.rows(); ++m) program.groups.emplace_back(m, 1);
  else
    program.groups.emplace_back(0, a.rows());

  Eigen::VectorXd x = Eigen::VectorXd::Zero(2 * n + 1);
  x[2 * n] = 2 * program.v.norm();
  double best = 0;
  for (double tau = 1; tau < 1e14; tau *= 10) {
    program.centre(x, tau);
    best = std::max(best, program.bound(x));
    const double t = x[2 * n];
    if (t - best < 1e-8 * t || t < 1e-12) break;
  }
  const Eigen::VectorXcd w = program.masses(x);
  for (Index p = 0; p < n; ++p) result.masses[p] = limit[p] == 0 ? std::complex<double>() : w[p] * scale / column[p];
  result.bound = best * scale;
  return result;
}

}  // namespace whirl::diagnosis
