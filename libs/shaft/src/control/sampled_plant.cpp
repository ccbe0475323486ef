#include "control/sampled_plant.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <unsupported/Eigen/MatrixFunctions>

#include "synchronous_solution.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/shaft/control/plant_rows.hpp"
#include "whirl/shaft/reduction.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

MatrixXd actuator_columns(const Rotor& rotor, const System& s) {
  const Index n = s.size(), m = static_cast<Index>(rotor.actuators.size());
  MatrixXd push(2 * n, m);
  for (Index k = 0; k < m; ++k) {
    const double angle = rotor.actuators[static_cast<std::size_t>(k)].angle;
    push.col(k) << std::cos(angle) * s.actuators.row(k).transpose(), std::sin(angle) * s.actuators.row(k).transpose();
  }
  return push;
}

MatrixXd probe_rows(const Rotor& rotor, const System& s) {
  const Index n = s.size(), p = static_cast<Index>(rotor.probes.size());
  MatrixXd read(p, 2 * n);
  for (Index k = 0; k < p; ++k) {
    const Probe& probe = rotor.probes[static_cast<std::size_t>(k)];
    const Eigen::RowVectorXd row = s.deflection.row(s.node_at(probe.position));
    read.row(k) << std::cos(probe.angle) * row, std::sin(probe.angle) * row;
  }
  return read;
}

PlantFamily::PlantFamily(const Rotor& rotor, const System& full, int modes) {
  ReductionOptions options;
  options.modes = modes > 0 ? modes : static_cast<int>(full.size());
  options.static_shapes = false;
  options.speeds = 0;
  system_ = reduce(full, options).system;
  push_ = actuator_columns(rotor, system_);
  read_ = probe_rows(rotor, system_);
  for (std::size_t j = 0; j < rotor.actuators.size(); ++j)
    if (rotor.actuators[j].bandwidth > 0) late_.emplace_back(static_cast<Index>(j), rotor.actuators[j].bandwidth);
  const Index n = system_.size();
  const VectorXd k = plane_equations(system_, 0).stiffness.diagonal();
  scale_.resize(2 * n);
  for (Index i = 0; i < n; ++i) scale_[i] = scale_[n + i] = std::sqrt((std::abs(k[i]) + std::abs(k[n + i])) / 2);
  scale_ = scale_.cwiseMax(1e-4 * scale_.maxCoeff());
}

std::pair<MatrixXd, MatrixXd> PlantFamily::continuous(double speed) const {
  const Index n = 2 * system_.size(), m = push_.cols();
  const Equations<MatrixXd> e = plane_equations(system_, speed);
  const Eigen::PartialPivLU<MatrixXd> mass(e.mass);
  MatrixXd a = MatrixXd::Zero(2 * n, 2 * n), b = MatrixXd::Zero(2 * n, m);
  a.topRightCorner(n, n) = scale_.asDiagonal();
  a.bottomLeftCorner(n, n) = -mass.solve(MatrixXd(e.stiffness * scale_.cwiseInverse().asDiagonal()));
  a.bottomRightCorner(n, n) = -mass.solve(e.damping);
  b.bottomRows(n) = mass.solve(push_);
  return {a, b};
}

namespace {

/// (x, u) after one step with u held.
std::pair<MatrixXd, MatrixXd> held(const MatrixXd& a, const MatrixXd& b, double sample_time) {
  const Index n = a.rows(), m = b.cols();
  MatrixXd both = MatrixXd::Zero(n + m, n + m);
  both.topLeftCorner(n, n) = sample_time * a;
  both.topRightCorner(n, m) = sample_time * b;
  const MatrixXd step = both.exp();
  return {step.topLeftCorner(n, n), step.topRightCorner(n, m)};
}

}  // namespace

SampledPlant PlantFamily::at(double speed, double sample_time) const {
  const auto [a, b] = continuous(speed);
  const Index n = a.rows(), late = static_cast<Index>(late_.size());
  SampledPlant plant;
  std::tie(plant.a, plant.b) = held(a, b, sample_time);
  plant.motion = n;
  plant.push = plant.b.rowwise().norm().maxCoeff() / sample_time;
  if (late > 0) {
    MatrixXd all = MatrixXd::Zero(n + late, n + late), by = MatrixXd::Zero(n + late, b.cols());
    all.topLeftCorner(n, n) = a;
    by.topRows(n) = b;
    for (Index k = 0; k < late; ++k) {
      const auto& [j, bandwidth] = late_[static_cast<std::size_t>(k)];
      const double size = b.col(j).norm();
      if (size == 0) continue;  // it moves nothing
      all.block(0, n + k, n, 1) = bandwidth / size * b.col(j);
      all(n + k, n + k) = -bandwidth;
      by.col(j).setZero();
      by(n + k, j) = size;
    }
    std::tie(plant.a, plant.b) = held(all, by, sample_time);
  }
  plant.c = MatrixXd::Zero(read_.rows(), n + late);
  plant.c.leftCols(n / 2) = read_ * scale_.cwiseInverse().asDiagonal();
  return plant;
}

VectorXcd PlantFamily::unbalance_readings(double speed) const { return read_ * synchronous_solution(system_, speed); }

VectorXcd PlantFamily::poles(double speed) const {
  return Eigen::EigenSolver<MatrixXd>(continuous(speed).first, false).eigenvalues();
}

}  // namespace whirl::shaft
