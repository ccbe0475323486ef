#include "whirl/control/hinfinity.hpp"

#include <cmath>
#include <optional>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::control {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

/// The stabilising X >= 0 of A' X + X A + X R X + Q = 0, from the stable invariant subspace of its Hamiltonian.
std::optional<MatrixXd> stabilising(const MatrixXd& a, const MatrixXd& r, const MatrixXd& q) {
  constexpr double kOnAxis = 1e-10, kNegative = -1e-9;
  const Index n = a.rows();
  MatrixXd h(2 * n, 2 * n);
  h << a, r, -q, -a.transpose();
  const Eigen::EigenSolver<MatrixXd> eigen(h);
  MatrixXcd upper(n, n), lower(n, n);
  Index stable = 0;
  const double size = eigen.eigenvalues().cwiseAbs().maxCoeff();
  const MatrixXcd vectors = eigen.eigenvectors();
  for (Index k = 0; k < 2 * n; ++k) {
    const double real = eigen.eigenvalues()[k].real();
    if (std::abs(real) < kOnAxis * size) return {};
    if (real > 0) continue;
    if (stable == n) return {};
    upper.col(stable) = vectors.col(k).head(n);
    lower.col(stable) = vectors.col(k).tail(n);
    ++stable;
  }
  if (stable != n) return {};
  const MatrixXd x =
      Eigen::PartialPivLU<MatrixXcd>(upper.transpose()).solve(MatrixXcd(lower.transpose())).transpose().real();
  const MatrixXd even = 0.5 * (x + x.transpose());
  if (!even.allFinite()) return {};
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(even, Eigen::EigenvaluesOnly).eigenvalues();
  if (values.minCoeff() < kNegative * std::max(values.maxCoeff(), 0.0)) return {};
  return even;
}

/// The central controller at that level; none: the level is not reached.
std::optional<HInfinity> at_level(const WeightedPlant& p, double level) {
  const double part = 1 / (level * level);
  const MatrixXd gain = p.b2 * p.b2.transpose(), seen = p.c2.transpose() * p.c2;
  const MatrixXd pushed = p.b1 * p.b1.transpose(), wanted = p.c1.transpose() * p.c1;
  const auto x = stabilising(p.a, part * pushed - gain, wanted);
  if (!x) return {};
  const auto y = stabilising(p.a.transpose(), part * wanted - seen, pushed);
  if (!y) return {};
  const MatrixXd both = *x * *y;
  if (both.eigenvalues().cwiseAbs().maxCoeff() >= level * level) return {};
  const Index n = p.a.rows();
  const MatrixXd z = Eigen::PartialPivLU<MatrixXd>(MatrixXd(MatrixXd::Identity(n, n) - part * *y * *x)).inverse();
  const MatrixXd f = -p.b2.transpose() * *x, zl = -z * *y * p.c2.transpose();
  return HInfinity{p.a + part * pushed * *x + p.b2 * f + zl * p.c2, -zl, f, 0, level};
}

}  // namespace

HInfinity solve_hinfinity(const WeightedPlant& plant, double slack) {
  constexpr double kClose = 1e-4, kMost = 1e9;
  double high = 1;
  while (!at_level(plant, high)) {
    high *= 4;
    if (high > kMost) throw Error("H-infinity: no controller holds this plant: its unstable part is out of reach");
  }
  double low = high;
  while (low > 1 / kMost && at_level(plant, low)) low /= 4;
  while (high / low > 1 + kClose) {
    const double middle = std::sqrt(low * high);
    (at_level(plant, middle) ? high : low) = middle;
  }
  std::optional<HInfinity> out = at_level(plant, slack * high);
  if (!out) throw Error("H-infinity: the level above the least one is not reached; scale the plant");
  out->least = high;
  return *out;
}

}  // namespace whirl::control
