#include "whirl/shaft/transient.hpp"

#include <array>
#include <cmath>

#include "synchronous_solution.hpp"
#include "transient/pencil_inverse.hpp"
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

constexpr Complex kQuarterTurn{0, 1};
constexpr int kStepHalvings = 7;

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
  static constexpr std::size_t kStages = kReal ? 1 : 2;  // real: the second is the conjugate of the first

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
        gravity_ = kQuarterTurn * down;
    }
    before_ = held_ = pending_ = VectorXd::Zero(o.control.start ? o.control.columns.cols() : 0);
    bandwidth_ = VectorXd::Zero(held_.size());
    if (o.control.bandwidth.size() > 0) bandwidth_ = o.control.bandwidth;
    if (o.control.start) controller_ = o.control.start();
    directions_ = directions(o.control.columns);
    dq_ = dv_ = stage_ = VectorXcd::Zero(gravity_.size());
    state_ = VectorXcd::Zero(3 * gravity_.size() + 2 * directions_.cols());
    inner_ = VectorXcd::Zero(static_cast<Index>(kStages) * gravity_.size());
    inward_.resize(inner_.size(), state_.size());
    for (std::size_t j = 0; constant_ && j < kStages; ++j) prepare(j);
    start(o);
  }

  void advance(double t) {
    const double middle = drive_.speed(t + step_ / 2);
    if (constant_) {
      advance_prepared(t, middle);
      return;
    }
    const Equations<Matrix> e = equations(middle);
    const Vector first = force(t + stages_.at[0] * step_), second = force(t + stages_.at[1] * step_);
    const Vector momentum = e.mass * v_ + e.damping * q_, inertia = e.mass * q_;
    dq_.setZero();
    dv_.setZero();
    for (std::size_t j = 0; j < kStages; ++j) {
      const Complex s = stages_.rate[j] / step_, one = stages_.one[j];
      const auto row = static_cast<Index>(j);
      lu_.compute(s * s * e.mass + s * e.damping + e.stiffness);
      stage_ = lu_.solve(VectorXcd(s * one * (momentum + s * inertia) + stages_.inverse(row, 0) * first +
                                   stages_.inverse(row, 1) * second));
      add_stage(j);
    }
    end_step();
  }

  /// A sample of the controller.
  void control(const SampledForces& c, double t) {
    const Index n = system_.size();
    VectorXd x(n), y(n), none;
    observe(x, y, none, t);
    before_ = acting(t);
    sampled_at_ = t;
    held_ = pending_;
    pending_ = controller_(c.rows.leftCols(n) * x + c.rows.rightCols(n) * y, drive_.angle(t), drive_.speed(t));
  }

  /// Coordinates of both planes, and the forces of the actuators.
  void observe(Eigen::Ref<VectorXd> x, Eigen::Ref<VectorXd> y, Eigen::Ref<VectorXd> forces, double t) const {
    if constexpr (kReal) {
      x = q_.head(x.size());
      y = q_.tail(y.size());
    } else {
      x = q_.real();
      y = q_.imag();
    }
    if (forces.size() > 0) forces = acting(t);
  }

 private:
  Equations<Matrix> equations(double speed) const {
    if constexpr (kReal)
      return plane_equations(system_, speed);
    else
      return circular_equations(system_, speed);
  }

  /// Coordinates of the force (W^2 - i W') u e^{i theta} + b e^{i theta} + gravity + what a controller holds in the
  /// columns of `directions`.
  template <class Out>
  void put_force(double t, Out&& all) const {
    const double w = drive_.speed(t), angle = drive_.angle(t), c = std::cos(angle), s = std::sin(angle);
    all[0] = w * w * c + drive_.rate * s;
    all[1] = w * w * s - drive_.rate * c;
    all[2] = c;
    all[3] = s;
    all[4] = 1;
    if (held_.size() > 0) all.tail(held_.size()) = acting(t).template cast<typename std::decay_t<Out>::Scalar>();
  }
  /// Forces of the actuators: what is held, reached at once or as a first order from what acted at the sample.
  VectorXd acting(double t) const {
    VectorXd force = held_;
    for (Index j = 0; j < force.size(); ++j)
      if (bandwidth_[j] > 0) force[j] += (before_[j] - held_[j]) * std::exp(-bandwidth_[j] * (t - sampled_at_));
    return force;
  }
  Matrix directions(const MatrixXd& push) const {
    Matrix all(gravity_.size(), 5 + held_.size());
    const auto both = [](const VectorXcd& u) -> Vector {
      if constexpr (kReal) {
        Vector planes(2 * u.size());
        planes << u.real(), u.imag();
        return planes;
      } else {
        return u;
      }
    };
    all.col(0) = both(system_.unbalance);
    all.col(1) = both(kQuarterTurn * system_.unbalance);
    all.col(2) = both(system_.bow);
    all.col(3) = both(kQuarterTurn * system_.bow);
    all.col(4) = gravity_;
    if (held_.size() == 0) return all;
    const Index n = system_.size();
    if constexpr (kReal)
      all.rightCols(held_.size()) = push.leftCols(held_.size());
    else
      all.rightCols(held_.size()) = push.topRows(n) + kQuarterTurn * push.bottomRows(n);
    return all;
  }
  Vector force(double t) const {
    Vector coordinates(directions_.cols());
    put_force(t, coordinates);
    return directions_ * coordinates;
  }

  /// Where only the speed changes, one Schur form serves every step. `inner_` of all stages follows from one product
  /// with (v, q, speed q, forces of both stages).
  void prepare(std::size_t j) {
    const Complex s = stages_.rate[j] / step_, one = stages_.one[j];
    PencilInverse& p = pencils_[j];
    p = PencilInverse(s * s * base_.mass + s * base_.damping + base_.stiffness,
                      s * turning_damping_ + turning_stiffness_);
    const MatrixXcd left = s * one * p.left(), by_force = p.left() * directions_;
    const auto row = static_cast<Index>(j), n = gravity_.size();
    inward_.middleRows(row * n, n) << left * base_.mass, left * (base_.damping + s * base_.mass),
        left * turning_damping_, stages_.inverse(row, 0) * by_force, stages_.inverse(row, 1) * by_force;
  }
  void advance_prepared(double t, double middle) {
    const Index n = q_.size();
    state_.head(n) = v_;
    state_.segment(n, n) = q_;
    const Index forces = directions_.cols();
    state_.segment(2 * n, n) = middle * q_;
    put_force(t + stages_.at[0] * step_, state_.segment(3 * n, forces));
    put_force(t + stages_.at[1] * step_, state_.tail(forces));
    inner_.noalias() = inward_ * state_;
    dq_.setZero();
    dv_.setZero();
    for (std::size_t j = 0; j < kStages; ++j) {
      pencils_[j].solve(middle, inner_.segment(static_cast<Index>(j) * n, n), stage_);
      add_stage(j);
    }
    end_step();
  }
  void add_stage(std::size_t j) {
    const Complex s = stages_.rate[j] / step_;
    dq_ += stages_.out[j] * stage_;
    dv_ += stages_.out[j] * (s * stage_ - s * stages_.one[j] * q_);
  }
  void end_step() {
    if constexpr (kReal) {
      q_ += 2 * dq_.real();
      v_ += 2 * dv_.real();
    } else {
      q_ += dq_;
      v_ += dv_;
    }
  }

  void start(const RunOptions& o) {
    q_ = v_ = Vector::Zero(gravity_.size());
    if (o.from_rest) return;
    const Index n = system_.size();
    const VectorXcd steady = synchronous_solution(system_, o.from);
    if constexpr (kReal) {
      q_ = steady.real();
      v_ = (kQuarterTurn * o.from * steady).real();
    } else {
      q_ = steady.head(n);
      v_ = kQuarterTurn * o.from * steady.head(n);
    }
    if (o.weight && !system_.vertical) q_ += Eigen::PartialPivLU<Matrix>(equations(o.from).stiffness).solve(gravity_);
  }

  const System& system_;
  Drive drive_;
  double step_;
  bool constant_;
  GaussStages stages_;
  Equations<Matrix> base_;
  Matrix turning_damping_, turning_stiffness_;
  Matrix directions_;
  VectorXd before_, held_, pending_, bandwidth_;  // at the sample, since, from the next on, N; rad/s
  double sampled_at_ = 0;
  SampledForces::Step controller_;
  Vector gravity_, q_, v_;
  VectorXcd dq_, dv_, stage_, inner_, state_;
  std::array<PencilInverse, kStages> pencils_;
  MatrixXcd inward_;
  Eigen::PartialPivLU<MatrixXcd> lu_;
};

/// What a run shows, from the coordinates of many samples at once: products of matrices in the place of one a sample.
class Observer {
 public:
  Observer(const System& s, RotorRun& run) : system_(s), run_(run) { x_ = y_ = MatrixXd(s.size(), kBlock); }
  template <class Integrator>
  void add(const Integrator& integrator, Index k) {
    if (count_ == kBlock) flush();
    integrator.observe(x_.col(count_), y_.col(count_), run_.forces.col(k), run_.time[k]);
    ++count_;
    end_ = k + 1;
  }

  void flush() {
    const Index first = end_ - count_;
    const auto put = [&](MatrixXd& out, const MatrixXd& rows, const MatrixXd& coordinates) {
      out.middleCols(first, count_).noalias() = rows * coordinates.leftCols(count_);
    };
    put(run_.x, system_.deflection, x_);
    put(run_.y, system_.deflection, y_);
    put(run_.body_x, system_.bodies, x_);
    put(run_.body_y, system_.bodies, y_);
    count_ = 0;
  }

 private:
  static constexpr Index kBlock = 128;
  const System& system_;
  RotorRun& run_;
  MatrixXd x_, y_;
  Index count_ = 0, end_ = 0;
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
  run.forces = MatrixXd::Zero(o.control.start ? o.control.columns.cols() : 0, samples);
  const auto held = o.control.start ? static_cast<int>(std::lround(o.control.period / run.step)) : 0;
  Integrator<Matrix> integrator(s, o, run.step);
  Observer observer(s, run);
  observer.add(integrator, 0);
  for (Index k = 1; k < samples; ++k) {
    for (int p = 0; p < parts; ++p) {
      const double t = run.time[k - 1] + p * run.step;
      if (held > 0 && p % held == 0) integrator.control(o.control, t);
      integrator.advance(t);
    }
    observer.add(integrator, k);
  }
  observer.flush();
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
  const double periods = o.control.start ? o.sample_time / o.control.period : 0.5;
  if (o.control.start && std::abs(periods - std::round(periods)) > 1e-6 * periods)
    throw Error::in_field("sample time", std::to_string(o.sample_time), "a multiple of the controller's");
  const bool circular = isotropic_over(s, o.from, o.to);
  const auto once = [&](const RunOptions& options, int parts) {
    return circular ? integrate_run<MatrixXcd>(s, options, parts) : integrate_run<MatrixXd>(s, options, parts);
  };
  // First against steps four times as long, which cost a quarter. Those of a controller end at its samples, and a run
  // of a few samples has none four times as long.
  constexpr double kFew = 16;
  const bool wide_steps = !o.control.start && o.duration / o.sample_time >= kFew;
  const int steps = wide_steps ? 1 : o.control.start ? 2 * static_cast<int>(std::lround(periods)) : 2;
  RunOptions wide = o;
  if (wide_steps) wide.sample_time *= 4;
  RotorRun coarse = once(wide, std::max(1, steps / 2));
  for (int k = 0, parts = steps, every = wide_steps ? 4 : 1;; ++k, parts *= 2, every = 1) {
    RotorRun fine = once(o, parts);
    double size = 0, change = 0;
    for (Index at = 0; at < coarse.x.cols() && at * every < fine.x.cols(); ++at)
      for (const auto& [a, b] : {std::pair{&fine.x, &coarse.x}, std::pair{&fine.y, &coarse.y}}) {
        size = std::max(size, a->col(at * every).cwiseAbs().maxCoeff());
        change = std::max(change, (a->col(at * every) - b->col(at)).cwiseAbs().maxCoeff());
      }
    // Richardson, order 4: r^4 - 1 for steps r times as long.
    fine.step_error = size > 0 ? change / size / (every == 4 ? 255 : 15) : 0;
    if (!(fine.step_error > o.tolerance) || k == kStepHalvings) return fine;
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
