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

using Entry = PeriodicSystem::Entry;
using Part = PeriodicSystem::Part;

/// The system at the points of `b` on the orbit of `s`.
PeriodicSystem::Values on_orbit(const PeriodicSystem& system, Part part, const Basis& b, const PeriodicSolution& s) {
  const Eigen::MatrixXd q = b.values.lazyProduct(s.coefficients), v = s.omega * b.rate.lazyProduct(s.coefficients);
  return system.evaluate(part, q, v, b.tau, s.omega, s.force);
}

/// Coefficients a0, c1, s1, ... of an entry.
Eigen::VectorXd spectrum(const Basis& b, const Entry& e) {
  if (e.samples != nullptr) return b.project.lazyProduct(Eigen::Map<const Eigen::VectorXd>(e.samples, b.tau.size()));
  Eigen::VectorXd constant = Eigen::VectorXd::Zero(b.project.rows());
  constant[0] = e.constant;
  return constant;
}

/// The matrix that multiplies a motion by g(tau) and projects it again: sums and differences of the harmonics of g up
/// to 2 H, cos k cos l = (cos(k - l) + cos(k + l)) / 2 and so on, the same sums over the points as project g values.
Eigen::MatrixXd product_matrix(const Basis& twice, const Entry& g, Index m) {
  const Eigen::VectorXd x = spectrum(twice, g);
  if (g.samples == nullptr) return g.constant * Eigen::MatrixXd::Identity(m, m);
  const auto c = [&](Index k) { return k == 0 ? 2 * x[0] : x[2 * k - 1]; };
  const auto s = [&](Index k) { return k == 0 ? 0.0 : x[2 * k]; };
  Eigen::MatrixXd p(m, m);
  p(0, 0) = x[0];
  for (Index l = 1; 2 * l < m; ++l) {
    p(2 * l - 1, 0) = c(l);
    p(2 * l, 0) = s(l);
    p(0, 2 * l - 1) = 0.5 * c(l);
    p(0, 2 * l) = 0.5 * s(l);
    for (Index k = 1; 2 * k < m; ++k) {
      const double cd = c(std::abs(k - l)), cs = c(k + l), ss = s(k + l);
      const double sd = k > l ? s(k - l) : -s(l - k);
      p(2 * k - 1, 2 * l - 1) = 0.5 * (cd + cs);
      p(2 * k - 1, 2 * l) = 0.5 * (ss - sd);
      p(2 * k, 2 * l - 1) = 0.5 * (ss + sd);
      p(2 * k, 2 * l) = 0.5 * (cd - cs);
    }
  }
  return p;
}

/// block -= factor * p * d/dtau.
template <class Block>
void subtract_rate(Block block, const Eigen::MatrixXd& p, double factor) {
  for (Index l = 1; 2 * l < p.cols(); ++l) {
    block.col(2 * l - 1) += (factor * static_cast<double>(l)) * p.col(2 * l);
    block.col(2 * l) -= (factor * static_cast<double>(l)) * p.col(2 * l - 1);
  }
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
  const Basis& twice = basis(2 * s.harmonics(), points_for(s.harmonics()));
  const PeriodicSystem::Values v = on_orbit(system, Part::all, b, s);
  const Eigen::MatrixXd d1 = differentiate(s.coefficients), d2 = differentiate(d1);
  Balance r;
  r.residual.resize(n * m);
  r.jacobian.setZero(n * m, n * m);
  r.by_parameter.resize(n * m);
  for (Index i = 0; i < n; ++i) {
    const bool second = system.order(i) == 2;
    auto residual = r.residual.segment(i * m, m);
    auto by = r.by_parameter.segment(i * m, m);
    residual = -spectrum(b, v.f(i));
    by = -spectrum(b, parameter == Parameter::force ? v.by_force(i) : v.by_speed(i));
    if (second)
      residual += s.omega * s.omega * d2.col(i);
    else
      residual += s.omega * d1.col(i);
    for (Index j = 0; j < n; ++j) {
      auto block = r.jacobian.block(i * m, j * m, m, m);
      if (!v.by_q(i, j).zero()) block -= product_matrix(twice, v.by_q(i, j), m);
      if (v.by_v(i, j).zero()) continue;
      const Eigen::MatrixXd p = product_matrix(twice, v.by_v(i, j), m);
      subtract_rate(block, p, s.omega);
      if (parameter == Parameter::speed) by -= p * d1.col(j);
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
    if (parameter != Parameter::speed) continue;
    if (second)
      by += 2 * s.omega * d2.col(i);
    else
      by += d1.col(i);
  }
  return r;
}

Eigen::VectorXd balance_residual(const PeriodicSystem& system, const PeriodicSolution& s) {
  const Index n = system.size(), m = s.coefficients.rows();
  const Basis& b = basis(s.harmonics(), points_for(s.harmonics()));
  const PeriodicSystem::Values v = on_orbit(system, Part::f, b, s);
  const Eigen::MatrixXd d1 = differentiate(s.coefficients), d2 = differentiate(d1);
  Eigen::VectorXd r(n * m);
  for (Index i = 0; i < n; ++i) {
    auto own = r.segment(i * m, m);
    own = -spectrum(b, v.f(i));
    if (system.order(i) == 2)
      own += s.omega * s.omega * d2.col(i);
    else
      own += s.omega * d1.col(i);
  }
  return r;
}

double truncation(const PeriodicSystem& system, const PeriodicSolution& s) {
  const int h = s.harmonics(), wide = 2 * h + 1;
  const Index m = s.coefficients.rows();
  const Basis& b = basis(wide, points_for(wide));
  const Eigen::MatrixXd q = b.values.leftCols(m).lazyProduct(s.coefficients),
                        rate = s.omega * b.rate.leftCols(m).lazyProduct(s.coefficients);
  const PeriodicSystem::Values v = system.evaluate(Part::f, q, rate, b.tau, s.omega, s.force);
  double worst = 0;
  for (Index i = 0; i < system.size(); ++i) {
    const Eigen::VectorXd x = spectrum(b, v.f(i));
    const double kept = x.head(m).cwiseAbs().maxCoeff();
    // What the missed harmonic of the force would move: force over k^2 (order 2) against the motion's own.
    double missed = 0;
    for (Index k = m; k < x.size(); ++k) {
      const double order = b.order[k];
      missed = std::max(missed, std::abs(x[k]) / (system.order(i) == 2 ? order * order : order));
    }
    if (kept > 0) worst = std::max(worst, missed / kept);
  }
  return worst;
}

namespace {

/// The variational equation over one period by the classical Runge-Kutta method: `v` at both ends and the middle of
/// every step. N: coordinates and velocities, or Dynamic.
template <int N>
Eigen::VectorXcd monodromy(const PeriodicSystem& system, const PeriodicSystem::Values& v, int steps, double h) {
  using Matrix = Eigen::Matrix<double, N, N>;
  const Index n = system.size();
  struct Element {
    Index row, column;
    Entry entry;
  };
  std::vector<Index> velocity(static_cast<std::size_t>(n), -1);
  Index size = n;
  for (Index i = 0; i < n; ++i)
    if (system.order(i) == 2) velocity[static_cast<std::size_t>(i)] = size++;
  Matrix constant = Matrix::Zero(size, size);
  std::vector<Element> elements;
  const auto add = [&](Index row, Index column, const Entry& e) {
    if (e.samples == nullptr)
      constant(row, column) += e.constant;
    else
      elements.push_back({row, column, e});
  };
  for (Index i = 0; i < n; ++i) {
    const Index own = velocity[static_cast<std::size_t>(i)], row = own >= 0 ? own : i;
    if (row != i) constant(i, row) = 1;
    for (Index j = 0; j < n; ++j) {
      add(row, j, v.by_q(i, j));
      if (velocity[static_cast<std::size_t>(j)] >= 0) add(row, velocity[static_cast<std::size_t>(j)], v.by_v(i, j));
    }
  }
  const auto matrix = [&](Index p) {
    Matrix a = constant;
    for (const Element& e : elements) a(e.row, e.column) += e.entry.samples[p];
    return a;
  };
  Matrix x = Matrix::Identity(size, size), a0 = matrix(0), a1, a2, k1, k2, k3, k4, at;
  for (int step = 0; step < steps; ++step) {
    a1 = matrix(2 * step + 1);
    a2 = matrix((2 * step + 2) % (2 * steps));
    k1.noalias() = a0 * x;
    at = x + 0.5 * h * k1;
    k2.noalias() = a1 * at;
    at = x + 0.5 * h * k2;
    k3.noalias() = a1 * at;
    at = x + h * k3;
    k4.noalias() = a2 * at;
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    a0 = a2;
  }
  return x.eigenvalues();
}

/// Frequency and damping of the fastest linear motion on the orbit, an upper bound, rad/s.
double fastest_motion(const PeriodicSystem& system, const PeriodicSystem::Values& v, Index points) {
  const auto largest = [&](const Entry& e) {
    return e.samples == nullptr ? std::abs(e.constant)
                                : Eigen::Map<const Eigen::ArrayXd>(e.samples, points).abs().maxCoeff();
  };
  double stiffness = 0, damping = 0;
  for (Index i = 0; i < system.size(); ++i) {
    for (Index j = 0; j < system.size(); ++j) {
      stiffness = std::max(stiffness, largest(v.by_q(i, j)));
      damping = std::max(damping, largest(v.by_v(i, j)));
    }
  }
  return std::sqrt(stiffness) + damping;
}

}  // namespace

Eigen::VectorXcd floquet_multipliers(const PeriodicSystem& system, const PeriodicSolution& s) {
  // Steps that resolve the fastest linear motion: at least 48 a period, 7 a radian of its own.
  int steps = 48;
  const Basis* b = &basis(s.harmonics(), 2 * steps);
  PeriodicSystem::Values v = on_orbit(system, Part::slopes, *b, s);
  const double fastest = fastest_motion(system, v, b->tau.size());
  while (steps < 1536 && steps < 2 * std::numbers::pi * fastest / s.omega * 7) steps *= 2;
  if (steps > 48) {
    b = &basis(s.harmonics(), 2 * steps);
    v = on_orbit(system, Part::slopes, *b, s);
  }
  Index size = system.size();
  for (Index i = 0; i < system.size(); ++i) size += system.order(i) == 2;
  const double h = 2 * std::numbers::pi / s.omega / steps;
  if (size == 2) return monodromy<2>(system, v, steps, h);
  if (size == 4) return monodromy<4>(system, v, steps, h);
  return monodromy<Eigen::Dynamic>(system, v, steps, h);
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
