#include "whirl/shaft/transient.hpp"

#include <array>
#include <cmath>

#include "synchronous_solution.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

constexpr Complex kImaginary{0, 1};
constexpr int kHalvings = 7;

/// With y' = A y + g and the stages Y = y0 + h a (A Y + g) of the Gauss method, a = T diag(m, m*) T^-1: each column of
/// T^-1 Y follows from one system (s - A) W = s e y0 + g^, s = 1 / (h m), e = T^-1 1, g^ = T^-1 g, and
/// y1 = y0 + d W with d = b' a^-1 T.
struct GaussStages {
  std::array<double, 2> at;     // stage times, parts of the step
  std::array<Complex, 2> rate;  // 1 / m
  std::array<Complex, 2> one;   // e
  std::array<Complex, 2> out;   // d
  Eigen::Matrix2cd inverse;     // T^-1

  GaussStages() {
    const double r = std::sqrt(3.0) / 6;
    at = {0.5 - r, 0.5 + r};
    Eigen::Matrix2cd t;
    for (const int j : {0, 1}) {
      const Complex m(0.25, (j == 0 ? 1 : -1) * r / 2);
      rate[static_cast<std::size_t>(j)] = 1.0 / m;
      t(0, j) = (0.25 - r) / (m - 0.25);  // first row of (a - m) v = 0 with v = (t, 1)
      t(1, j) = 1;
    }
    const Complex determinant = t(0, 0) * t(1, 1) - t(0, 1) * t(1, 0);
    inverse << t(1, 1), -t(0, 1), -t(1, 0), t(0, 0);
    inverse /= determinant;
    for (const int j : {0, 1}) {
      one[static_cast<std::size_t>(j)] = inverse(j, 0) + inverse(j, 1);
      out[static_cast<std::size_t>(j)] = 6 * r * (t(1, j) - t(0, j));  // b' a^-1 = (-sqrt 3, sqrt 3)
    }
  }
};

/// Angle, speed and forcing over time.
struct Drive {
  double from, rate;
  double speed(double t) const { return from + rate * t; }
  double angle(double t) const { return from * t + rate * t * t / 2; }
};

/// The equations over time, in x + i y (complex) where the supports allow it, else in (q_x, q_y) (real).
template <class Matrix>
class Integrator {
 public:
  using Vector = Eigen::Matrix<typename Matrix::Scalar, Eigen::Dynamic, 1>;
  static constexpr bool kReal = std::is_same_v<Matrix, MatrixXd>;

  Integrator(const System& s, const RunOptions& o, double step)
      : system_(s), drive_{o.from, (o.to - o.from) / o.duration}, step_(step), constant_(s.constant()) {
    const Index n = s.size();
    base_ = equations(0);
    const Equations<Matrix> one = equations(1);
    turning_damping_ = one.damping - base_.damping;  // both grow with speed
    turning_stiffness_ = one.stiffness - base_.stiffness;
    gravity_ = Vector::Zero(kReal ? 2 * n : n);
    if (o.weight && !s.vertical) {
      const VectorXd down = -9.80665 * s.weight;
      if constexpr (kReal)
        gravity_.tail(n) = down;
      else
        gravity_ = kImaginary * down;
    }
    start(o);
  }

  void advance(double t) {
    const double middle = drive_.speed(t + step_ / 2);
    if (!constant_) {
      now_ = equations(middle);
    } else {
      now_.mass = base_.mass;
      now_.damping = base_.damping + middle * turning_damping_;
      now_.stiffness = base_.stiffness + middle * turning_stiffness_;
    }
    const Vector first = force(t + stages_.at[0] * step_), second = force(t + stages_.at[1] * step_);
    VectorXcd dq = VectorXcd::Zero(q_.size()), dv = dq;
    const Vector momentum = now_.mass * v_ + now_.damping * q_, inertia = now_.mass * q_;
    for (const std::size_t j : {std::size_t{0}, std::size_t{1}}) {
      const Complex s = stages_.rate[j] / step_, e = stages_.one[j];
      const auto row = static_cast<Index>(j);
      const MatrixXcd dynamic = s * s * now_.mass + s * now_.damping + now_.stiffness;
      const VectorXcd right =
          s * e * (momentum + s * inertia) + stages_.inverse(row, 0) * first + stages_.inverse(row, 1) * second;
      lu_.compute(dynamic);
      const VectorXcd wq = lu_.solve(right);
      dq += stages_.out[j] * wq;
      dv += stages_.out[j] * (s * wq - s * e * q_);
      if (kReal) break;  // the second stage is the conjugate of the first
    }
    if constexpr (kReal) {
      q_ += 2 * dq.real();
      v_ += 2 * dv.real();
    } else {
      q_ += dq;
      v_ += dv;
    }
  }

  void observe(RotorRun& run, Index k) const {
    const Index n = system_.size();
    VectorXd x, y;
    if constexpr (kReal) {
      x = q_.head(n);
      y = q_.tail(n);
    } else {
      x = q_.real();
      y = q_.imag();
    }
    run.x.col(k) = system_.deflection * x;
    run.y.col(k) = system_.deflection * y;
    run.body_x.col(k) = system_.bodies * x;
    run.body_y.col(k) = system_.bodies * y;
  }

 private:
  Equations<Matrix> equations(double speed) const {
    if constexpr (kReal)
      return plane_equations(system_, speed);
    else
      return circular_equations(system_, speed);
  }

  /// (W^2 - i W') u e^{i theta} + b e^{i theta} + gravity.
  Vector force(double t) const {
    const double w = drive_.speed(t);
    const Complex turn = std::polar(1.0, drive_.angle(t));
    const VectorXcd f = (Complex(w * w, -drive_.rate) * turn) * system_.unbalance + turn * system_.bow;
    if constexpr (kReal) {
      Vector both(gravity_);
      both.head(f.size()) += f.real();
      both.tail(f.size()) += f.imag();
      return both;
    } else {
      return f + gravity_;
    }
  }

  void start(const RunOptions& o) {
    q_ = v_ = Vector::Zero(gravity_.size());
    if (o.from_rest) return;
    const Index n = system_.size();
    const VectorXcd steady = synchronous_solution(system_, o.from);
    if constexpr (kReal) {
      q_ = steady.real();
      v_ = (kImaginary * o.from * steady).real();
    } else {
      q_ = steady.head(n);
      v_ = kImaginary * o.from * steady.head(n);
    }
    if (o.weight && !system_.vertical) q_ += Eigen::PartialPivLU<Matrix>(equations(o.from).stiffness).solve(gravity_);
  }

  const System& system_;
  Drive drive_;
  double step_;
  bool constant_;
  GaussStages stages_;
  Equations<Matrix> base_, now_;
  Matrix turning_damping_, turning_stiffness_;
  Vector gravity_, q_, v_;
  Eigen::PartialPivLU<MatrixXcd> lu_;
};

template <class Matrix>
RotorRun integrate_run(const System& s, const RunOptions& o, int parts) {
  const auto samples = static_cast<Index>(std::llround(o.duration / o.sample_time)) + 1;
  RotorRun run;
  run.step = o.sample_time / parts;
  run.time = VectorXd::LinSpaced(samples, 0, static_cast<double>(samples - 1) * o.sample_time);
  const double rate = (o.to - o.from) / o.duration;
  run.speed = (o.from + rate * run.time.array()).matrix();
  run.angle = (o.from * run.time.array() + rate / 2 * run.time.array().square()).matrix();
  run.x = run.y = MatrixXd(s.deflection.rows(), samples);
  run.body_x = run.body_y = MatrixXd(s.bodies.rows(), samples);
  Integrator<Matrix> integrator(s, o, run.step);
  integrator.observe(run, 0);
  for (Index k = 1; k < samples; ++k) {
    for (int p = 0; p < parts; ++p) integrator.advance(run.time[k - 1] + p * run.step);
    integrator.observe(run, k);
  }
  return run;
}

bool isotropic_over(const System& s, double from, double to) {
  for (int k = 0; k <= 50; ++k)
    if (!s.isotropic(from + (to - from) * k / 50)) return false;
  return true;
}

}  // namespace

RotorRun simulate_run(const System& s, const RunOptions& o) {
  if (!(o.duration > 0)) throw Error::in_field("duration", std::to_string(o.duration), "above 0 s");
  if (!(o.sample_time > 0)) throw Error::in_field("sample time", std::to_string(o.sample_time), "above 0 s");
  if (!(o.duration / o.sample_time < 1e8)) throw Error("more than 1e8 samples: a longer sample time is needed");
  if (!(o.from >= 0 && o.to >= 0)) throw Error("the speeds of a run are 0 and above");
  const bool circular = isotropic_over(s, o.from, o.to);
  const auto once = [&](const RunOptions& options, int parts) {
    return circular ? integrate_run<MatrixXcd>(s, options, parts) : integrate_run<MatrixXd>(s, options, parts);
  };
  RunOptions wide = o;
  wide.sample_time *= 2;
  RotorRun coarse = once(wide, 1);
  for (int k = 0, parts = 1, every = 2;; ++k, parts *= 2, every = 1) {
    RotorRun fine = once(o, parts);
    double size = 0, change = 0;
    for (Index at = 0; at < coarse.x.cols() && at * every < fine.x.cols(); ++at)
      for (const auto& [a, b] : {std::pair{&fine.x, &coarse.x}, std::pair{&fine.y, &coarse.y}}) {
        size = std::max(size, a->col(at * every).cwiseAbs().maxCoeff());
        change = std::max(change, (a->col(at * every) - b->col(at)).cwiseAbs().maxCoeff());
      }
    fine.step_error = size > 0 ? change / size / 15 : 0;  // Richardson, order 4
    if (!(fine.step_error > o.tolerance) || k == kHalvings) return fine;
    coarse = std::move(fine);
  }
}

RunPeak run_peak(const RotorRun& run, Index node) {
  RunPeak p;
  for (Index k = 0; k < run.time.size(); ++k) {
    const double size = std::hypot(run.x(node, k), run.y(node, k));
    if (size > p.size) p = {size, run.speed[k], run.time[k]};
  }
  return p;
}

}  // namespace whirl::shaft
