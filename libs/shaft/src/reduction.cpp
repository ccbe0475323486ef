#include "whirl/shaft/reduction.hpp"

#include <algorithm>
#include <cmath>

#include "synchronous_solution.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

/// Stiffness and mass of a plane at a speed, supports by the mean of their direct coefficients.
std::pair<MatrixXd, MatrixXd> mean_plane(const System& s, double speed) {
  MatrixXd stiffness = s.stiffness, mass = s.mass;
  for (const Attachment& a : s.supports) {
    const SupportLaw::Values v = a.law.at(speed);
    stiffness += v.stiffness.trace() / 2 * a.row * a.row.transpose();
    mass += v.mass.trace() / 2 * a.row * a.row.transpose();
    if (a.tilt.size() > 0) stiffness += a.tilt_stiffness * a.tilt * a.tilt.transpose();
  }
  return {stiffness, mass};
}

/// Eigenvectors of K v = w^2 M v, scaled to v' M v = 1, ascending. By the inverse, where there is one: the slow modes
/// are then exact whatever the fastest, of a short element, is.
std::pair<VectorXd, MatrixXd> plane_modes(const MatrixXd& stiffness, const MatrixXd& mass) {
  const Eigen::LLT<MatrixXd> held((stiffness + stiffness.transpose()) / 2);
  if (held.info() == Eigen::Success) {
    const MatrixXd lower = held.matrixL();
    MatrixXd a = lower.triangularView<Eigen::Lower>().solve(mass);
    a = lower.triangularView<Eigen::Lower>().solve(MatrixXd(a.transpose())).eval();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd((a + a.transpose()) / 2));
    if (solver.eigenvalues()[0] > 0) {
      const VectorXd frequencies = solver.eigenvalues().reverse().cwiseSqrt().cwiseInverse();
      const MatrixXd shapes = lower.transpose().triangularView<Eigen::Upper>().solve(solver.eigenvectors());
      return {frequencies, shapes.rowwise().reverse() * frequencies.asDiagonal()};
    }
  }
  const Eigen::LLT<MatrixXd> cholesky(mass);
  if (cholesky.info() != Eigen::Success) throw Error("the mass of the rotor is not positive: a part has no inertia");
  const MatrixXd lower = cholesky.matrixL();
  MatrixXd a = lower.triangularView<Eigen::Lower>().solve(stiffness);
  a = lower.triangularView<Eigen::Lower>().solve(MatrixXd(a.transpose())).eval();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd((a + a.transpose()) / 2));
  return {solver.eigenvalues().cwiseMax(0).cwiseSqrt(),
          lower.transpose().triangularView<Eigen::Upper>().solve(solver.eigenvectors())};
}

/// Forces that the model must answer to at rest: of supports, unbalance, bow, weight; and at gyroscopic stations.
std::vector<VectorXd> applied_forces(const System& s) {
  std::vector<VectorXd> list;
  for (const Attachment& a : s.supports) {
    list.push_back(a.row);
    if (a.tilt.size() > 0) list.push_back(a.tilt);
  }
  for (Index k = 0; k < s.actuators.rows(); ++k) list.emplace_back(s.actuators.row(k).transpose());
  for (const VectorXcd* v : {&s.unbalance, &s.bow}) {
    list.emplace_back(v->real());
    list.emplace_back(v->imag());
  }
  list.push_back(s.weight);
  std::erase_if(list, [](const VectorXd& v) { return v.norm() == 0; });
  return list;
}

void compare(const System& full, const ReductionOptions& o, double highest, Reduction& r) {
  System loaded = full, small = r.system;
  if (full.unbalance.norm() == 0) {
    loaded.unbalance = full.weight.cast<std::complex<double>>();
    small.unbalance = r.system.weight.cast<std::complex<double>>();
  }
  const Index n = full.size(), m = small.size();
  for (int k = 1; k <= o.speeds; ++k) {
    const double speed = highest * k / o.speeds;
    const VectorXcd a = synchronous_solution(loaded, speed), b = synchronous_solution(small, speed);
    double difference = 0, largest = 0;
    for (const int plane : {0, 1}) {
      const VectorXcd exact = full.deflection * a.segment(plane * n, n);
      const VectorXcd found = small.deflection * b.segment(plane * m, m);
      difference = std::max(difference, (exact - found).cwiseAbs().maxCoeff());
      largest = std::max(largest, exact.cwiseAbs().maxCoeff());
    }
    r.speeds.push_back(speed);
    r.errors.push_back(largest > 0 ? difference / largest : 0);
    if (r.errors.back() > r.worst_error) {
      r.worst_error = r.errors.back();
      r.worst_speed = speed;
    }
  }
}

}  // namespace

System project(const System& s, const MatrixXd& basis) {
  System r = s;
  const auto onto = [&](const MatrixXd& m) { return MatrixXd(basis.transpose() * m * basis); };
  r.mass = onto(s.mass);
  r.gyroscopic = onto(s.gyroscopic);
  r.stiffness = onto(s.stiffness);
  r.rotating = onto(s.rotating);
  for (Attachment& a : r.supports) {
    a.row = (basis.transpose() * a.row).eval();
    if (a.tilt.size() > 0) a.tilt = (basis.transpose() * a.tilt).eval();
  }
  r.unbalance = basis.transpose() * s.unbalance;
  r.bow = basis.transpose() * s.bow;
  r.weight = basis.transpose() * s.weight;
  r.deflection = s.deflection * basis;
  r.slope = s.slope * basis;
  r.bodies = s.bodies * basis;
  if (s.actuators.rows() > 0) r.actuators = s.actuators * basis;
  return r;
}

Reduction reduce(const System& s, const ReductionOptions& o) {
  if (o.modes < 1) throw Error::in_field("modes", std::to_string(o.modes), "1 and above");
  const auto [stiffness, mass] = mean_plane(s, o.highest / 2);
  const auto [frequencies, shapes] = plane_modes(stiffness, mass);
  const Index kept = std::min<Index>(o.modes, s.size());
  MatrixXd basis = shapes.leftCols(kept);
  if (o.static_shapes && kept < s.size()) {
    MatrixXd held = stiffness;
    if (Eigen::LLT<MatrixXd>(held).info() != Eigen::Success)
      held += 1e-9 * stiffness.diagonal().maxCoeff() / mass.diagonal().maxCoeff() * mass;
    const Eigen::PartialPivLU<MatrixXd> lu(held);
    for (const VectorXd& force : applied_forces(s)) {
      if (basis.cols() == s.size()) break;
      VectorXd v = lu.solve(force);
      const double before = std::sqrt(v.dot(mass * v));
      for (int pass = 0; pass < 2; ++pass) v -= basis * (basis.transpose() * (mass * v));
      const double length = std::sqrt(v.dot(mass * v));
      if (!(length > 1e-7 * before)) continue;  // already among the modes
      basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
      basis.col(basis.cols() - 1) = v / length;
    }
  }
  // Coordinates that are modes of the reduced plane themselves.
  const auto [found, turned] = plane_modes(basis.transpose() * stiffness * basis, basis.transpose() * mass * basis);
  basis = (basis * turned).eval();
  Reduction r;
  r.system = project(s, basis);
  r.frequencies.assign(found.begin(), found.end());
  r.basis = basis;
  compare(s, o, o.highest > 0 ? o.highest : frequencies[std::max<Index>(0, kept / 3 - 1)], r);
  return r;
}

}  // namespace whirl::shaft
