#include <algorithm>
#include <cmath>

#include "mode_pairs.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/modes.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace {

constexpr double kRounding = 1e-12;  // of the largest stiffness: a free rotor's is zero
constexpr int kScanned = 200;        // speeds between which supports that depend on speed are taken as smooth

/// Whether the directions of whirl are wanted: they need the vectors, two thirds of the work.
enum class Whirl { left_out, found };

/// Answers of the eigenproblem with the supports' values at `speed`, ascending.
std::vector<Critical> criticals_with_supports_at(const System& s, double speed, double ratio, Whirl whirl) {
  const Index n = s.size();
  System still = s;
  still.rotating.setZero();
  Equations<MatrixXd> e = plane_equations(still, speed);
  e.stiffness = (e.stiffness + e.stiffness.transpose()).eval() / 2;
  // In forward and backward circles, z = x + i y and its mirror: G does not couple them. (q_x, q_y) = T (f, b).
  MatrixXcd inertia = ((e.mass + e.mass.transpose()) / 2).cast<Complex>();
  inertia.topRightCorner(n, n) -= Complex(0, ratio) * s.gyroscopic;
  inertia.bottomLeftCorner(n, n) += Complex(0, ratio) * s.gyroscopic;
  // v = L^-H u: (L^-1 inertia L^-H) u = (1 / w^2) u. A small shift keeps a free rotor's stiffness definite.
  Eigen::LLT<MatrixXd> cholesky(e.stiffness);
  if (s.free > 0 || cholesky.info() != Eigen::Success) {
    const double shift =
        kRounding * e.stiffness.diagonal().cwiseAbs().maxCoeff() / e.mass.diagonal().cwiseAbs().maxCoeff();
    cholesky.compute(MatrixXd(e.stiffness + shift * e.mass));
  }
  std::vector<Critical> found;
  if (cholesky.info() != Eigen::Success) return found;
  const MatrixXcd lower = MatrixXd(cholesky.matrixL()).cast<Complex>();
  MatrixXcd reduced = lower.triangularView<Eigen::Lower>().solve(inertia);
  reduced = lower.triangularView<Eigen::Lower>().solve(MatrixXcd(reduced.adjoint())).eval();
  const Eigen::SelfAdjointEigenSolver<MatrixXcd> solver(
      (reduced + reduced.adjoint()) / 2, whirl == Whirl::found ? Eigen::ComputeEigenvectors : Eigen::EigenvaluesOnly);
  const double largest = solver.eigenvalues().cwiseAbs().maxCoeff();
  for (Index k = 2 * n - 1; k >= 0; --k) {
    const double value = solver.eigenvalues()[k];
    if (value <= 1e-14 * largest) break;  // no real speed: the gyroscopic moment outruns the mode
    const double frequency = std::sqrt(1 / value);
    found.push_back({ratio * frequency, frequency, 0});
    if (whirl == Whirl::left_out) continue;
    const VectorXcd v = lower.adjoint().triangularView<Eigen::Upper>().solve(solver.eigenvectors().col(k));
    const VectorXcd x = s.deflection * v.head(n), y = s.deflection * v.tail(n);
    const double forward = (x + Complex(0, 1) * y).squaredNorm(), backward = (x - Complex(0, 1) * y).squaredNorm();
    found.back().direction = (forward - backward) / (forward + backward);
  }
  if (s.free > 0 && !found.empty()) {
    const double bends = found[std::min(found.size() - 1, static_cast<std::size_t>(s.free))].frequency;
    std::erase_if(found, [&](const Critical& c) { return c.frequency < kRigid * bends; });
  }
  return found;
}

}  // namespace

bool returns_to_place(const System& system, double speed) {
  const Equations<MatrixXd> e = plane_equations(system, speed);
  const MatrixXd stiffness = (e.stiffness + e.stiffness.transpose()) / 2;
  const double shift = kRounding * stiffness.diagonal().cwiseAbs().maxCoeff() / e.mass.diagonal().cwiseAbs().maxCoeff();
  return Eigen::LLT<MatrixXd>(MatrixXd(stiffness + shift * (e.mass + e.mass.transpose()) / 2)).info() == Eigen::Success;
}

namespace {

struct Excess {
  double speed, value;  ///< value: of the k-th answer there above the speed
};

/// Where the excess of the k-th answer changes its sign: the straight line between both ends, of which one that stays
/// counts half from then on, so that it moves too (Illinois).
template <class Answers>
double crossing(const Answers& at, std::size_t k, Excess low, Excess high) {
  constexpr double kClose = 1e-9;
  int stayed = 0;  // 1: high at the last step, -1: low
  double best = high.speed;
  while (high.speed - low.speed > kClose * high.speed) {
    const double least = 0.4 * kClose * high.speed;  // so far from an end, and the bracket closes
    const double line = low.speed - low.value * (high.speed - low.speed) / (high.value - low.value);
    const double speed = std::clamp(line, low.speed + least, high.speed - least);
    const std::vector<Critical> there = at(speed);
    if (k >= there.size()) break;
    best = speed;
    const double value = there[k].speed - speed;
    if ((value > 0) == (low.value > 0)) {
      low = {speed, value};
      if (stayed > 0) high.value /= 2;
      stayed = 1;
    } else {
      high = {speed, value};
      if (stayed < 0) low.value /= 2;
      stayed = -1;
    }
  }
  return best;
}

}  // namespace

std::vector<Critical> criticals(const System& s, double highest, double spin_per_whirl) {
  const auto below = [&](std::vector<Critical> list) {
    std::erase_if(list, [&](const Critical& c) { return c.speed > highest; });
    return list;
  };
  if (!returns_to_place(s, 0))
    throw Error(
        "the supports do not bring the rotor back to its place at rest (a negative stiffness): it has no critical "
        "speeds "
        "without control; see whirl rotor control");
  if (s.constant()) return below(criticals_with_supports_at(s, 0, spin_per_whirl, Whirl::found));
  // The k-th answer w_k(W) with the supports of speed W: critical where w_k(W) = W.
  const auto at = [&](double speed) { return criticals_with_supports_at(s, speed, spin_per_whirl, Whirl::left_out); };
  std::vector<Critical> result;
  std::vector<Critical> before = at(0);
  for (int i = 1; i <= kScanned; ++i) {
    const double from = highest * (i - 1) / kScanned, to = highest * i / kScanned;
    std::vector<Critical> now = at(to);
    for (std::size_t k = 0; k < std::min(before.size(), now.size()); ++k) {
      if ((before[k].speed > from) == (now[k].speed > to)) continue;
      const double best = crossing(at, k, {from, before[k].speed - from}, {to, now[k].speed - to});
      result.push_back(criticals_with_supports_at(s, best, spin_per_whirl, Whirl::found)[k]);
    }
    before = std::move(now);
  }
  std::sort(result.begin(), result.end(), [](const Critical& a, const Critical& b) { return a.speed < b.speed; });
  return result;
}

}  // namespace whirl::shaft
