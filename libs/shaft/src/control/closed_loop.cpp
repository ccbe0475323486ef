#include "control/closed_loop.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
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

const VectorXcd& ClosedLoop::eigenvalues() const {
  if (eigenvalues_.size() == 0) eigenvalues_ = Eigen::EigenSolver<MatrixXd>(matrix_, false).eigenvalues();
  return eigenvalues_;
}

double ClosedLoop::growth() const { return std::log(eigenvalues().cwiseAbs().maxCoeff()) / step_; }

bool ClosedLoop::decays() const {
  // No eigenvalue exceeds the norm, and no trace exceeds the size times the largest of them. The margins are those of
  // rounding; what they leave open the eigenvalues decide.
  constexpr int kSquarings = 24;
  constexpr double kBelow = 0.5, kAbove = 1.01, kOverflows = 1e100;
  MatrixXd power = matrix_, square(matrix_.rows(), matrix_.cols());
  for (int k = 0; k < kSquarings; ++k) {
    const double norm = power.norm();
    if (norm < kBelow) return true;
    if (std::abs(power.trace()) > kAbove * static_cast<double>(power.rows())) return false;
    if (!(norm < kOverflows)) break;
    square.noalias() = power * power;
    power.swap(square);
  }
  return growth() < 0;
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
  for (const Complex z : eigenvalues()) {
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

LineResponse ClosedLoop::line(double frequency) const {
  const Index m = command_.cols(), p = disturb_.cols();
  MatrixXd inputs(matrix_.rows(), m + p);
  inputs << command_, disturb_;
  const MatrixXcd x = respond(frequency, inputs), readings = read_ * x, forces = x.middleRows(force_at_, m);
  return {readings.leftCols(m), MatrixXcd::Identity(p, p) + readings.rightCols(p), forces.leftCols(m),
          forces.rightCols(p)};
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

namespace {

/// Diagonal of C (z - M)^-1 B at many z, C some rows of the identity. In the Hessenberg form of M every z takes n^2
/// steps in place of n^3 (Laub, IEEE Trans. Automatic Control 26, 1981, 407-408).
class DiagonalResponse {
 public:
  DiagonalResponse(const MatrixXd& matrix, const MatrixXd& input, Index first_row) {
    const Eigen::HessenbergDecomposition<MatrixXd> form(matrix);
    const MatrixXd turn = form.matrixQ();
    form_ = -MatrixXd(form.matrixH());
    input_ = turn.transpose() * input;
    output_ = turn.middleRows(first_row, input.cols());
  }
  VectorXcd at(Complex z) {
    const Index n = form_.rows(), m = input_.cols();
    a_ = form_.cast<Complex>();
    a_.diagonal().array() += z;
    x_ = input_.cast<Complex>();
    for (Index k = 0; k + 1 < n; ++k) {  // one entry below the diagonal, the larger of both as pivot
      if (std::norm(a_(k + 1, k)) > std::norm(a_(k, k))) {
        a_.row(k).tail(n - k).swap(a_.row(k + 1).tail(n - k));
        x_.row(k).swap(x_.row(k + 1));
      }
      const Complex factor = a_(k + 1, k) / a_(k, k);
      if (factor == 0.0) continue;
      a_.row(k + 1).tail(n - k - 1) -= factor * a_.row(k).tail(n - k - 1);
      x_.row(k + 1) -= factor * x_.row(k);
    }
    VectorXcd diagonal = VectorXcd::Zero(m);
    for (Index k = n - 1; k >= 0; --k) {
      const auto right = a_.row(k).tail(n - k - 1).transpose();
      for (Index j = 0; j < m; ++j) {
        const Complex known = right.cwiseProduct(x_.col(j).tail(n - k - 1)).sum();
        x_(k, j) = (x_(k, j) - known) / a_(k, k);
        diagonal[j] += output_(j, k) * x_(k, j);
      }
    }
    return diagonal;
  }

 private:
  using Rows = Eigen::Matrix<Complex, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  MatrixXd form_, input_, output_;
  Rows a_;
  MatrixXcd x_;
};

}  // namespace

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
  DiagonalResponse answer(matrix_, push_, force_at_);
  VectorXd peak = VectorXd::Zero(push_.cols());
  for (const double f : frequencies)
    peak = peak.cwiseMax((1.0 + answer.at(std::polar(1.0, f * step_)).array()).abs().matrix()).eval();
  return peak;
}

}  // namespace whirl::shaft
