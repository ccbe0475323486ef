#include "whirl/response/harmonic_balance.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "whirl/core/decompositions.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;

/// Fourier basis of H harmonics at N points: values, derivative by tau, projection. Made once per size and thread.
struct Basis {
  Eigen::VectorXd tau;
  Eigen::MatrixXd values, rate, project;
  Eigen::VectorXd order;  ///< k of each coefficient

  Basis(int harmonics, int points) {
    const Index n = 2 * harmonics + 1;
    tau = Eigen::VectorXd::LinSpaced(points, 0, 2 * std::numbers::pi * (points - 1) / points);
    values.resize(points, n);
    rate.resize(points, n);
    order.resize(n);
    values.col(0).setOnes();
    rate.col(0).setZero();
    order[0] = 0;
    for (int k = 1; k <= harmonics; ++k) {
      values.col(2 * k - 1) = (k * tau.array()).cos();
      values.col(2 * k) = (k * tau.array()).sin();
      rate.col(2 * k - 1) = -k * values.col(2 * k);
      rate.col(2 * k) = k * values.col(2 * k - 1);
      order[2 * k - 1] = order[2 * k] = k;
    }
    project = values.transpose() * (2.0 / points);
    project.row(0) *= 0.5;
  }
};

const Basis& basis(int harmonics, int points) {
  thread_local std::map<std::pair<int, int>, Basis> made;
  return made.try_emplace({harmonics, points}, harmonics, points).first->second;
}

/// Exact for cubic terms at all kept harmonics; smooth other terms converge exponentially.
int points_for(int harmonics) { return std::max(16, 4 * harmonics + 4); }

/// d/dtau in the coefficients: (c, s) -> (k s, -k c).
Eigen::MatrixXd differentiate(const Eigen::MatrixXd& x) {
  Eigen::MatrixXd d = Eigen::MatrixXd::Zero(x.rows(), x.cols());
  for (Index k = 1; 2 * k < x.rows(); ++k) {
    d.row(2 * k - 1) = static_cast<double>(k) * x.row(2 * k);
    d.row(2 * k) = -static_cast<double>(k) * x.row(2 * k - 1);
  }
  return d;
}

}  // namespace

std::complex<double> PeriodicSolution::harmonic(Index i, int k) const {
  if (k == 0) return coefficients(0, i);
  if (k > harmonics()) return 0;
  return {coefficients(2 * k - 1, i), -coefficients(2 * k, i)};
}

Eigen::MatrixXd PeriodicSolution::orbit(int points) const { return basis(harmonics(), points).values * coefficients; }

Balance balance(const PeriodicSystem& system, const PeriodicSolution& s, Parameter parameter) {
  const Index n = system.size(), m = s.coefficients.rows();
  const Basis& b = basis(s.harmonics(), points_for(s.harmonics()));
  const Eigen::MatrixXd q = b.values * s.coefficients, dq = b.rate * s.coefficients;
  const PeriodicSystem::Values v = system.evaluate(q, s.omega * dq, b.tau, s.omega, s.force);
  const Eigen::MatrixXd d1 = differentiate(s.coefficients), d2 = differentiate(d1);
  Balance r;
  r.residual.resize(n * m);
  r.jacobian.setZero(n * m, n * m);
  r.by_parameter.resize(n * m);
  for (Index i = 0; i < n; ++i) {
    const bool second = system.order(i) == 2;
    auto residual = r.residual.segment(i * m, m);
    residual = (second ? Eigen::VectorXd(s.omega * s.omega * d2.col(i)) : Eigen::VectorXd(s.omega * d1.col(i))) -
               b.project * v.f.col(i);
    Eigen::VectorXd by = parameter == Parameter::force ? v.by_force.col(i) : v.by_speed.col(i);
    for (Index j = 0; j < n; ++j) {
      const auto gq = v.by_q.col(i * n + j), gv = v.by_v.col(i * n + j);
      auto block = r.jacobian.block(i * m, j * m, m, m);
      if (!gq.isZero(0)) block -= b.project * gq.asDiagonal() * b.values;
      if (gv.isZero(0)) continue;
      block -= s.omega * (b.project * gv.asDiagonal() * b.rate);
      if (parameter == Parameter::speed) by += gv.cwiseProduct(dq.col(j));
    }
    auto own = r.jacobian.block(i * m, i * m, m, m);
    for (Index k = 1; 2 * k < m; ++k) {
      const double order = static_cast<double>(k) * s.omega;
      if (second) {
        own(2 * k - 1, 2 * k - 1) -= order * order;
        own(2 * k, 2 * k) -= order * order;
      } else {
        own(2 * k - 1, 2 * k) += order;
        own(2 * k, 2 * k - 1) -= order;
      }
    }
    r.by_parameter.segment(i * m, m) = -b.project * by;
    if (parameter == Parameter::speed)
      r.by_parameter.segment(i * m, m) +=
          second ? Eigen::VectorXd(2 * s.omega * d2.col(i)) : Eigen::VectorXd(d1.col(i));
  }
  return r;
}

double truncation(const PeriodicSystem& system, const PeriodicSolution& s) {
  const int h = s.harmonics(), wide = 2 * h + 1;
  const Basis& b = basis(wide, points_for(wide));
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(2 * wide + 1, system.size());
  x.topRows(s.coefficients.rows()) = s.coefficients;
  const PeriodicSystem::Values v = system.evaluate(b.values * x, s.omega * (b.rate * x), b.tau, s.omega, s.force);
  double worst = 0;
  for (Index i = 0; i < system.size(); ++i) {
    const Eigen::VectorXd spectrum = b.project * v.f.col(i);
    const double kept = spectrum.head(2 * h + 1).cwiseAbs().maxCoeff();
    // What the missed harmonic of the force would move: force over k^2 (order 2) against the motion's own.
    double missed = 0;
    for (Index k = 2 * h + 1; k < spectrum.size(); ++k) {
      const double order = b.order[k];
      missed = std::max(missed, std::abs(spectrum[k]) / (system.order(i) == 2 ? order * order : order));
    }
    if (kept > 0) worst = std::max(worst, missed / kept);
  }
  return worst;
}

Eigen::VectorXcd floquet_multipliers(const PeriodicSystem& system, const PeriodicSolution& s) {
  const Index n = system.size();
  // Steps that resolve the fastest linear motion: at least 48 a period, 20 a radian of its own.
  const Basis& few = basis(s.harmonics(), points_for(s.harmonics()));
  const PeriodicSystem::Values rough =
      system.evaluate(few.values * s.coefficients, s.omega * (few.rate * s.coefficients), few.tau, s.omega, s.force);
  const double fastest = std::sqrt(rough.by_q.cwiseAbs().maxCoeff()) + rough.by_v.cwiseAbs().maxCoeff();
  int steps = 48;
  while (steps < 1536 && steps < 2 * std::numbers::pi * fastest / s.omega * 7) steps *= 2;
  const Basis& b = basis(s.harmonics(), 2 * steps);
  const PeriodicSystem::Values v =
      system.evaluate(b.values * s.coefficients, s.omega * (b.rate * s.coefficients), b.tau, s.omega, s.force);
  std::vector<Index> velocity(static_cast<std::size_t>(n), -1);
  Index size = n;
  for (Index i = 0; i < n; ++i)
    if (system.order(i) == 2) velocity[static_cast<std::size_t>(i)] = size++;
  const auto matrix = [&](Index p, Eigen::MatrixXd& a) {
    a.setZero(size, size);
    for (Index i = 0; i < n; ++i) {
      const Index row = velocity[static_cast<std::size_t>(i)] >= 0 ? velocity[static_cast<std::size_t>(i)] : i;
      if (row != i) a(i, row) = 1;
      for (Index j = 0; j < n; ++j) {
        a(row, j) += v.by_q(p, i * n + j);
        if (velocity[static_cast<std::size_t>(j)] >= 0)
          a(row, velocity[static_cast<std::size_t>(j)]) += v.by_v(p, i * n + j);
      }
    }
  };
  const double h = 2 * std::numbers::pi / s.omega / steps;
  Eigen::MatrixXd x = Eigen::MatrixXd::Identity(size, size), a0, a1, a2, k1, k2, k3, k4;
  matrix(0, a0);
  for (int step = 0; step < steps; ++step) {
    matrix(2 * step + 1, a1);
    matrix((2 * step + 2) % (2 * steps), a2);
    k1.noalias() = a0 * x;
    k2.noalias() = a1 * (x + 0.5 * h * k1);
    k3.noalias() = a1 * (x + 0.5 * h * k2);
    k4.noalias() = a2 * (x + h * k3);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    a0 = a2;
  }
  return x.eigenvalues();
}

bool solve_periodic(const PeriodicSystem& system, PeriodicSolution& s, int iterations, double tolerance) {
  for (int k = 0; k < iterations; ++k) {
    const Balance b = balance(system, s, Parameter::speed);
    if (!b.residual.allFinite()) return false;
    const Eigen::VectorXd step = b.jacobian.partialPivLu().solve(b.residual);
    if (!step.allFinite()) return false;
    s.coefficients -= step.reshaped(s.coefficients.rows(), s.coefficients.cols());
    if (step.norm() <= tolerance * s.coefficients.norm() + 1e-300) return true;
  }
  return false;
}

}  // namespace whirl::response
