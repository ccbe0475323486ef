#include "output_error/score.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "whirl/core/least_squares.hpp"

namespace whirl::identification::detail {

std::vector<Remainder> remainders(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient,
                                  const std::vector<int>& active, const std::vector<std::vector<int>>& candidates) {
  const Eigen::VectorXd scale =
      normal.diagonal()(active).unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0; });
  Eigen::MatrixXd own = scale.asDiagonal() * normal(active, active) * scale.asDiagonal();
  own.diagonal().array() += 1e-13;
  std::vector<int> all;
  for (const std::vector<int>& c : candidates) all.insert(all.end(), c.begin(), c.end());
  const auto sparse = solve_sparse(own, scale.asDiagonal() * normal(active, all));
  const Eigen::LDLT<Eigen::MatrixXd> factor(sparse ? Eigen::MatrixXd() : own);
  std::vector<Remainder> left;
  Eigen::Index at = 0;
  for (const std::vector<int>& c : candidates) {
    const Eigen::MatrixXd with = normal(active, c), alone = normal(c, c);
    Remainder r{alone, gradient(c), 0};
    if (!active.empty()) {
      const auto n = static_cast<Eigen::Index>(c.size());
      const Eigen::MatrixXd scaled = sparse ? Eigen::MatrixXd(sparse->middleCols(at, n))
                                            : Eigen::MatrixXd(factor.solve(scale.asDiagonal() * with));
      at += n;
      const Eigen::MatrixXd explained = scale.asDiagonal() * scaled;
      r.information -= with.transpose() * explained;
      r.gradient -= explained.transpose() * gradient(active);
    }
    r.share = alone.trace() > 0 ? r.information.trace() / alone.trace() : 0;
    left.push_back(std::move(r));
  }
  return left;
}

Remainder remainder(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& columns, const Eigen::VectorXd& residual) {
  const Eigen::MatrixXd left = columns - basis * (basis.transpose() * columns);
  const double all = columns.squaredNorm();
  return {left.transpose() * left, left.transpose() * residual, all > 0 ? left.squaredNorm() / all : 0};
}

Evidence evidence(const Remainder& r, double variance) {
  constexpr double kExplained = 1e-12, kSame = 1e-13;  // shares of squares
  const Eigen::Index n = r.gradient.size();
  Evidence e{0, Eigen::VectorXd::Zero(n), 0};
  if (!(r.share > kExplained) || !(r.information.diagonal().maxCoeff() > 0)) return e;
  // Columns of unit length; directions that the columns of the candidate share count once.
  const Eigen::VectorXd scale =
      r.information.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      Eigen::MatrixXd(scale.asDiagonal() * r.information * scale.asDiagonal()));
  const Eigen::VectorXd turned = eigen.eigenvectors().transpose() * scale.cwiseProduct(r.gradient);
  int rank = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double value = eigen.eigenvalues()[k];
    if (!(value > kSame * eigen.eigenvalues()[n - 1])) continue;
    ++rank;
    e.score += turned[k] * turned[k] / value;
    e.coefficient += turned[k] / value * eigen.eigenvectors().col(k);
  }
  e.score /= variance * (1 + 0.18 * (rank - 1));
  e.coefficient = scale.cwiseProduct(e.coefficient);
  if (n == 1) e.sd = std::sqrt(variance / r.information(0, 0));
  return e;
}

}  // namespace whirl::identification::detail
