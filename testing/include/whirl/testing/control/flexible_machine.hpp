#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>

#include "whirl/core/control_types.hpp"
#include "whirl/core/decompositions.hpp"

/// A flexible rotor under control: nine point masses on a massless shaft in two elastic bearings, by influence
/// coefficients of the beam, four modes of each plane, gyroscopic moments of the disc, unbalance spread along the
/// shaft. Actuators and sensors sit at different stations. Nothing here knows RotorModel, RigParameters or libs/shaft.
namespace whirl::testing {

struct FlexibleMachine {
  static constexpr int kMasses = 9;
  double length = 0.8, diameter = 0.012, young = 2.06e11;    ///< m, m, Pa
  std::array<double, 2> bearing{2e6, 3e6};                   ///< stiffness, N/m
  double upright = 1.01;                                     ///< of the y plane over the x plane, stiffness
  double shaft_kg = 0.7, disc_kg = 1.5, disc_polar = 2e-3;   ///< kg, kg, kg m^2
  int disc = 4, actuator = 3, sensor = 5;                    ///< stations
  double damping = 0.01;                                     ///< ratio of the first mode; grows with the frequency
  std::array<std::complex<double>, kMasses> unbalance{};     ///< of each mass, m
  double gain = 1, turned = 0, lag = 5e-4, delay = 1e-3;     ///< of the force; rad; s; s
  double force_limit = 40;                                   ///< N
  double noise = 0.7e-6, age = 0.25e-3;                      ///< m rms; age of a reading, s
  std::array<double, 2> runout{6e-6, 3e-6}, runout_phase{};  ///< m, rad, once and twice a turn
  int counts = 2048;                                         ///< encoder lines
  double from = 190, to = 0, ramp = 8, still = 0.5;          ///< rad/s, rad/s, s, s

  /// Another one for every seed.
  static FlexibleMachine draw(std::uint64_t seed) {
    std::mt19937_64 random(seed * 15485863 + 29);
    const auto in = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    FlexibleMachine m;
    m.length = in(0.6, 0.9);
    m.diameter = in(0.010, 0.013);
    m.bearing = {in(0.5e6, 3e6), in(0.5e6, 3e6)};
    m.upright = 1 + in(-0.015, 0.015);
    m.shaft_kg = 7850 * std::numbers::pi / 4 * m.diameter * m.diameter * m.length;
    m.disc_kg = in(1, 2.5);
    m.disc_polar = m.disc_kg * in(0.5e-3, 1.5e-3);
    m.disc = 3 + static_cast<int>(in(0, 3));
    m.actuator = m.disc + (in(0, 1) < 0.5 ? -1 : 0);
    m.sensor = m.disc + (in(0, 1) < 0.5 ? 1 : 0);
    m.damping = in(0.006, 0.015);
    for (int k = 0; k < kMasses; ++k) {
      const double size = k == m.disc ? in(120e-6, 300e-6) : in(0, 150e-6);
      m.unbalance[static_cast<std::size_t>(k)] = std::polar(size, in(-3, 3));
    }
    m.lag = in(2e-4, 8e-4);
    for (std::size_t k = 0; k < 2; ++k) m.runout_phase[k] = in(-3, 3);
    return m;
  }
};

/// Modes of a machine: frequencies, and what force, unbalance and sensor have of each.
struct FlexibleModes {
  static constexpr int kModes = 4;
  using Vector = Eigen::Matrix<double, kModes, 1>;
  using Matrix = Eigen::Matrix<double, kModes, kModes>;
  Vector omega, drive, seen;  ///< rad/s; shapes at actuator and sensor, 1/sqrt(kg)
  Matrix upright, gyroscopic;
  Eigen::Matrix<std::complex<double>, kModes, 1> unbalance;

  explicit FlexibleModes(const FlexibleMachine& m) {
    constexpr int n = FlexibleMachine::kMasses;
    const double l = m.length, stiff = m.young * std::numbers::pi * std::pow(m.diameter, 4) / 64;
    const auto at = [l](int k) { return l * (k + 1) / (n + 1); };
    Eigen::Matrix<double, n, n> soft;
    Eigen::Matrix<double, n, 1> root, tilt = Eigen::Matrix<double, n, 1>::Zero();
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        // Deflection at the nearer station of a pinned beam, and the tilting of the whole shaft in its bearings.
        const double a = std::min(at(i), at(j)), b = l - std::max(at(i), at(j));
        soft(i, j) = a * b * (l * l - a * a - b * b) / (6 * l * stiff) +
                     (l - at(i)) * (l - at(j)) / (l * l * m.bearing[0]) + at(i) * at(j) / (l * l * m.bearing[1]);
      }
      root[i] = std::sqrt(m.shaft_kg / n + (i == m.disc ? m.disc_kg : 0));
    }
    tilt[m.disc + 1] = (n + 1) / (2 * l), tilt[m.disc - 1] = -tilt[m.disc + 1];
    // The slowest modes are the largest of sqrt(M) A sqrt(M).
    const Eigen::MatrixXd weighed = root.asDiagonal() * soft * root.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(weighed);
    Eigen::Matrix<double, n, kModes> shape;
    for (int k = 0; k < kModes; ++k) {
      omega[k] = 1 / std::sqrt(solver.eigenvalues()[n - 1 - k]);
      shape.col(k) = root.cwiseInverse().cwiseProduct(solver.eigenvectors().col(n - 1 - k));
    }
    drive = shape.row(m.actuator), seen = shape.row(m.sensor);
    upright = Matrix(m.upright * omega.cwiseAbs2().asDiagonal());
    const Vector slope = shape.transpose() * tilt;
    gyroscopic = m.disc_polar * slope * slope.transpose();
    for (int k = 0; k < kModes; ++k) {
      unbalance[k] = 0;
      for (int i = 0; i < n; ++i)
        unbalance[k] += shape(i, k) * root[i] * root[i] * m.unbalance[static_cast<std::size_t>(i)];
    }
  }
};

/// One run: read, write, advance once per millisecond.
class FlexibleRig {
 public:
  static constexpr double kTick = 1e-3;
  static constexpr int kSteps = 8;

  FlexibleRig(const FlexibleMachine& machine, std::uint64_t seed)
      : m_(machine), modes_(machine), random_(seed * 7907 + 3) {
    // The steady whirl at the first speed, without gyroscopic moments; the rest dies out.
    const double w = m_.from;
    for (int k = 0; k < FlexibleModes::kModes; ++k) {
      const double own = modes_.omega[k];
      const std::complex<double> q =
          modes_.unbalance[k] * w * w / std::complex<double>(own * own - w * w, 2 * ratio(k) * own * w);
      s_.x[k] = q.real(), s_.y[k] = q.imag(), s_.vx[k] = -w * q.imag(), s_.vy[k] = w * q.real();
    }
    look();
    sense();
  }
  long ticks() const { return std::lround((m_.ramp + m_.still) / kTick); }
  bool done() const { return tick_ >= ticks(); }
  Measurement read() const noexcept { return reading_; }
  void write(const Command& u) noexcept { sent_[slot(tick_)] = {u.ux, u.uy}; }
  void advance() noexcept {
    const double h = kTick / kSteps;
    const int early = static_cast<int>(std::lround(m_.age / h));
    for (int i = 0; i < kSteps; ++i) {
      if (i == kSteps - early) look();
      const double t = static_cast<double>(tick_) * kTick + i * h;
      target_ = acting(t);
      runge_kutta(t, h);
    }
    ++tick_;
    sent_[slot(tick_)] = sent_[slot(tick_ - 1)];
    sense();
  }
  /// Displacement of the shaft at the sensors, m.
  std::complex<double> z() const { return {modes_.seen.dot(s_.x), modes_.seen.dot(s_.y)}; }
  double speed() const { return speed_at(static_cast<double>(tick_) * kTick); }

 private:
  using Vector = FlexibleModes::Vector;
  struct State {
    Vector x = Vector::Zero(), y = Vector::Zero(), vx = Vector::Zero(), vy = Vector::Zero();
    std::complex<double> force;
  };
  static std::size_t slot(long tick) { return static_cast<std::size_t>(tick + 64) % 64; }
  double ratio(int k) const { return m_.damping * std::sqrt(modes_.omega[k] / modes_.omega[0]); }
  double speed_at(double t) const { return m_.from + std::min(t / m_.ramp, 1.0) * (m_.to - m_.from); }
  double angle_at(double t) const {
    const double rising = std::min(t, m_.ramp), rate = (m_.to - m_.from) / m_.ramp;
    return m_.from * rising + 0.5 * rate * rising * rising + m_.to * std::max(t - m_.ramp, 0.0);
  }
  std::complex<double> acting(double t) const {
    const double since = t - m_.delay;
    if (since < -1e-9) return 0;
    const std::complex<double> u = sent_[slot(static_cast<long>(since / kTick + 1e-6))];
    const double most = m_.force_limit;
    return std::polar(m_.gain, m_.turned) *
           std::complex<double>(std::clamp(u.real(), -most, most), std::clamp(u.imag(), -most, most));
  }
  State rates(const State& s, double t) const {
    const double w = speed_at(t), rate = t < m_.ramp ? (m_.to - m_.from) / m_.ramp : 0;
    const std::complex<double> turn = std::polar(1.0, angle_at(t)) * std::complex<double>(w * w, -rate);
    State d;
    d.x = s.vx, d.y = s.vy;
    for (int k = 0; k < FlexibleModes::kModes; ++k) {
      const double own = modes_.omega[k], c = 2 * ratio(k) * own;
      const std::complex<double> f = modes_.unbalance[k] * turn + modes_.drive[k] * s.force;
      d.vx[k] = f.real() - own * own * s.x[k] - c * s.vx[k];
      d.vy[k] = f.imag() - c * s.vy[k];
    }
    d.vy -= modes_.upright * s.y;
    d.vx -= w * (modes_.gyroscopic * s.vy);
    d.vy += w * (modes_.gyroscopic * s.vx);
    d.force = (target_ - s.force) / m_.lag;
    return d;
  }
  static State along(const State& s, const State& d, double h) {
    return {s.x + h * d.x, s.y + h * d.y, s.vx + h * d.vx, s.vy + h * d.vy, s.force + h * d.force};
  }
  void runge_kutta(double t, double h) noexcept {
    const State a = rates(s_, t), b = rates(along(s_, a, 0.5 * h), t + 0.5 * h),
                c = rates(along(s_, b, 0.5 * h), t + 0.5 * h), d = rates(along(s_, c, h), t + h);
    s_ = along(along(along(along(s_, a, h / 6), b, h / 3), c, h / 3), d, h / 6);
  }
  double gauss() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(random_() >> 11) * 0x1p-53;
    return sum;
  }
  void look() noexcept {
    const double angle = angle_at(static_cast<double>(tick_ + 1) * kTick - m_.age);
    seen_ = z() + std::complex<double>(m_.noise * gauss(), m_.noise * gauss());
    for (std::size_t k = 0; k < 2; ++k)
      seen_ += std::polar(m_.runout[k], static_cast<double>(k + 1) * angle + m_.runout_phase[k]);
  }
  void sense() noexcept {
    const double t = static_cast<double>(tick_) * kTick, line = 2 * std::numbers::pi / m_.counts,
                 angle = (std::floor(angle_at(t) / line) + 0.5) * line;
    // A tracking loop with its poles at 50 1/s.
    if (tick_ == 0) turn_ = angle, rate_ = m_.from;
    if (tick_ > 0) {
      const double error = angle - (turn_ + kTick * rate_);
      turn_ += kTick * rate_ + 0.15 * error, rate_ += kTick * change_ + 7.5 * error, change_ += 125 * error;
    }
    reading_ = {t, seen_.real(), seen_.imag(), angle, std::max(rate_, 0.0), change_, true};
    if (speed() == 0) reading_.omega = reading_.omega_dot = 0;
  }

  FlexibleMachine m_;
  FlexibleModes modes_;
  std::mt19937_64 random_;
  State s_;
  std::array<std::complex<double>, 64> sent_{};
  std::complex<double> target_, seen_;
  Measurement reading_;
  long tick_ = 0;
  double turn_ = 0, rate_ = 0, change_ = 0;
};

}  // namespace whirl::testing
