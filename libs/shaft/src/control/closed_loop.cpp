#include "control/closed_loop.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

ClosedLoop::ClosedLoop(const SampledPlant& plant, const RotorController& c, double speed, const LoopChange& change)
    : step_(c.sample_time) {
  const ControlGains g = c.at(speed);
  const Index n = plant.a.rows(), m = plant.b.cols(), k = c.states(), p = plant.c.rows();
  const Index turning = change.synchronous && c.adaptation > 0 ? 2 * m : 0;
  const Index queue = m * (1 + change.delay), size = n + k + queue + turning;
  force_at_ = n + k;
  const Index acting = force_at_ + m * change.delay, turn_at = force_at_ + queue;
  matrix_ = MatrixXd::Zero(size, size);
  matrix_.topLeftCorner(n, n) = plant.a;
  matrix_.block(0, acting, n, m) = change.gain * plant.b;
  MatrixXd state = MatrixXd::Zero(k, size);
  state.leftCols(n) = g.readings * plant.c;
  state.middleCols(n, k) = g.advance;
  state.middleCols(force_at_, m) = g.forces;
  matrix_.middleRows(n, k) = state;
  matrix_.middleRows(force_at_, m) = -g.feedback * state;
  for (int d = 0; d < change.delay; ++d) matrix_.block(force_at_ + m * (d + 1), force_at_ + m * d, m, m).setIdentity();
  if (turning > 0) {
    const SynchronousGains s = c.synchronous_at(speed);
    const double rate = -2 * c.adaptation * step_;
    const MatrixXcd moved = rate * s.correction * plant.c.cast<Complex>();
    MatrixXd rows = MatrixXd::Zero(2 * m, size);
    rows.topLeftCorner(m, n) = moved.real();
    rows.bottomLeftCorner(m, n) = moved.imag();
    rows.block(0, force_at_, m, m) = rate * s.relief.real();
    rows.block(m, force_at_, m, m) = rate * s.relief.imag();
    const double turn = speed * step_;
    rows.block(0, turn_at, m, m).diagonal().setConstant(std::cos(turn));
    rows.block(0, turn_at + m, m, m).diagonal().setConstant(-std::sin(turn));
    rows.block(m, turn_at, m, m).diagonal().setConstant(std::sin(turn));
    rows.block(m, turn_at + m, m, m).diagonal().setConstant(std::cos(turn));
    matrix_.bottomRows(2 * m) = rows;
    matrix_.middleRows(force_at_, m) += rows.topRows(m);
  }
  read_ = MatrixXd::Zero(p, size);
  read_.leftCols(n) = plant.c;
  command_ = MatrixXd::Zero(size, m);
  command_.middleRows(force_at_, m).setIdentity();
  disturb_ = MatrixXd::Zero(size, p);
  disturb_.middleRows(n, k) = g.readings;
  disturb_.middleRows(force_at_, m) = -g.feedback * g.readings;
  push_ = MatrixXd::Zero(size, m);
  push_.topRows(n) = change.gain * plant.b;
}

double ClosedLoop::growth() const {
  const Eigen::EigenSolver<MatrixXd> solver(matrix_, false);
  return std::log(solver.eigenvalues().cwiseAbs().maxCoeff()) / step_;
}

bool ClosedLoop::stable() const {
  // Norms of powers: |M^(2^k)| = |M^(2^(k-1))^2|, the scale kept apart so that nothing overflows. No norm grows faster
  // from one power to the next than it has until there, and no trace exceeds the size times the largest eigenvalue:
  // both decide long before the last power does.
  constexpr double kPasses = 1e-3;
  MatrixXd power = matrix_, square(matrix_.rows(), matrix_.cols());
  double log_scale = 0;
  const int needed = static_cast<int>(std::ceil(std::log2(60 / (kPasses * step_))));
  for (int squarings = 0;; ++squarings) {
    const double norm = power.norm(), allowed = std::exp2(squarings) * step_ * 2 * kPasses;
    if (norm == 0) return true;
    if (log_scale + std::log(norm) < allowed) return true;
    const double least = std::abs(power.trace()) / static_cast<double>(power.rows());
    if (squarings == needed || (least > 0 && log_scale + std::log(least) > allowed)) return false;
    power /= norm;
    log_scale = 2 * (log_scale + std::log(norm));
    square.noalias() = power * power;
    power.swap(square);
  }
}

std::vector<Complex> ClosedLoop::poles() const {
  std::vector<Complex> list;
  const Eigen::EigenSolver<MatrixXd> solver(matrix_, false);
  for (const Complex z : solver.eigenvalues()) {
    if (std::abs(z) < 1e-6 || z.imag() < 0) continue;
    list.push_back(std::log(z) / step_);
  }
  return list;
}

MatrixXcd ClosedLoop::respond(double frequency, const MatrixXd& input) const {
  MatrixXcd a = -matrix_.cast<Complex>();
  a.diagonal().array() += std::polar(1.0, frequency * step_);
  return Eigen::PartialPivLU<MatrixXcd>(a).solve(MatrixXcd(input.cast<Complex>()));
}

MatrixXcd ClosedLoop::influence(double frequency) const { return read_ * respond(frequency, command_); }

MatrixXcd ClosedLoop::output_sensitivity(double frequency) const {
  return MatrixXcd::Identity(read_.rows(), read_.rows()) + read_ * respond(frequency, disturb_);
}

MatrixXcd ClosedLoop::forces_of_commands(double frequency) const {
  return respond(frequency, command_).middleRows(force_at_, command_.cols());
}
MatrixXcd ClosedLoop::forces_of_readings(double frequency) const {
  return respond(frequency, disturb_).middleRows(force_at_, command_.cols());
}

VectorXd ClosedLoop::sensitivity(double frequency) const {
  const Index m = push_.cols();
  const MatrixXcd x = respond(frequency, push_);
  // What the plant is pushed with is the force at the end of the queue; without more delay it is the first.
  return (MatrixXcd::Identity(m, m) + x.middleRows(force_at_, m)).diagonal().cwiseAbs();
}

VectorXd ClosedLoop::force_noise() const {
  // P = M P M' + B B' by doubling.
  MatrixXd power = matrix_, covariance = disturb_ * disturb_.transpose();
  for (int k = 0; k < 40 && power.norm() > 1e-9; ++k) {
    covariance += (power * covariance * power.transpose()).eval();
    power = (power * power).eval();
  }
  return covariance.diagonal().segment(force_at_, command_.cols()).cwiseSqrt();
}

VectorXd ClosedLoop::sensitivity_peak() const {
  constexpr int kPoints = 160;
  std::vector<double> frequencies;
  const double highest = kPi / step_, lowest = 1e-4 * highest;
  for (int k = 0; k < kPoints; ++k) frequencies.push_back(lowest * std::pow(highest / lowest, k / (kPoints - 1.0)));
  // Peaks are narrow where a pole is near the axis.
  for (const Complex pole : poles())
    if (-pole.real() < 0.2 * pole.imag())
      for (const double part : {-1.0, 0.0, 1.0}) {
        const double at = pole.imag() + part * pole.real();
        if (at > 0 && at < highest) frequencies.push_back(at);
      }
  VectorXd peak = VectorXd::Zero(push_.cols());
  for (const double f : frequencies) peak = peak.cwiseMax(sensitivity(f)).eval();
  return peak;
}

}  // namespace whirl::shaft
