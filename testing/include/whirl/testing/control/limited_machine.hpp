#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/testing/control/small_turn.hpp"

/// A rotor with a gyroscopic second mode on amplifiers and sensors as data sheets describe them: limits of force and
/// slew, hysteresis, low-pass, jitter of the sampling, a drive that the unbalance brakes. Fourth-order Runge-Kutta in
/// complex coordinates, drawn from seeds. Nothing here knows RotorModel, RigParameters or a formula of the supervision.
namespace whirl::testing {

struct LimitedMachine {
  double mass = 2, stiffness = 2e4, damping = 2;   ///< kg, N/m, N s/m
  double cubic = 0;                                ///< N/m^3, radial
  double unbalance = 200e-6, unbalance_angle = 0;  ///< m, rad
  // Second mode: driven by actuators and unbalance, seen by the sensors; its whirls part with the speed.
  double second_hertz = 50, second_damping = 0.01, second_split = 0.1;
  double second_share = 0.1, second_unbalance = 0.1;  ///< of actuator and of unbalance, relative to the disc
  // Amplifier and actuator.
  double gain = 1, lag = 5e-4, delay = 1e-3;  ///< of the stated force; s; s
  double force_limit = 40;                    ///< N, as stated
  double force_reached = 40;                  ///< N, as it is
  double slew = 1e9;                          ///< N/s
  double hysteresis = 0;                      ///< width of the play between asked and acting force, N
  std::complex<double> wrong = 1;             ///< fault: both axes are multiplied by it from `wrong_from` on
  double wrong_y = 1;                         ///< fault: of y alone
  double wrong_from = 1e9, late_from = 1e9, late_by = 0;  ///< s
  // Sensors.
  double sensor_lag = 1e-4, age = 2e-4;  ///< low-pass; age of a reading, s
  double noise = 0.7e-6;                 ///< m rms
  double runout = 8e-6, runout_angle = 0;
  double clip = 1;    ///< m; readings beyond it stand still at it
  double jitter = 0;  ///< of the sampling instant, s, at most half of `age`
  // Drive.
  double inertia = 0.1;                              ///< kg m^2
  double drive = 5;                                  ///< N m s/rad: torque for each rad/s that it is behind
  double from = 150, to = 0, ramp = 4, still = 0.3;  ///< rad/s, rad/s, s, s
  bool whirling = true;                              ///< the run begins in the steady whirl of the disc; else at rest

  double critical() const { return std::sqrt(stiffness / mass); }

  /// The machine that a design is made for; another one for every seed.
  static LimitedMachine draw(std::uint64_t seed) {
    std::mt19937_64 random(seed * 6364136223846793005ULL + 1442695040888963407ULL);
    const auto in = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    LimitedMachine m;
    m.mass = std::exp(in(std::log(0.6), std::log(12.0)));
    const double w = 2 * std::numbers::pi * in(8, 16);
    m.stiffness = m.mass * w * w;
    m.damping = 2 * in(0.004, 0.02) * m.mass * w;
    m.cubic = in(0, 0.05) * m.stiffness / (5e-3 * 5e-3);
    m.unbalance = in(100e-6, 400e-6);
    m.unbalance_angle = in(-3, 3);
    m.second_hertz = in(2.8, 5.5) * w / (2 * std::numbers::pi);
    m.second_damping = in(0.005, 0.02);
    m.second_split = in(0.02, 0.2);
    m.second_share = in(0.005, 0.05) * (in(0, 1) < 0.5 ? -1 : 1);
    m.second_unbalance = in(0, 0.3);
    m.lag = in(2e-4, 8e-4);
    m.delay = 1e-3;
    m.from = in(1.8, 2.6) * w;
    m.force_limit = m.force_reached = in(0.9, 1.7) * m.mass * m.unbalance * m.from * m.from;
    m.slew = in(0.5, 3) * m.force_limit * m.from;
    m.hysteresis = in(0, 0.04) * m.force_limit;
    m.sensor_lag = in(3e-5, 5e-4);
    m.jitter = in(0, 8e-5);
    m.runout = in(2e-6, 10e-6);
    m.runout_angle = in(-3, 3);
    m.inertia = m.mass * in(0.005, 0.02);
    m.drive = m.inertia * in(10, 60);
    return m;
  }
  /// The machine that a run meets: unbalance 0.5 to 2 times, stiffness 20 % and gain 10 % either way, the second mode
  /// moved, actuators that reach 85 to 100 % of what is stated.
  LimitedMachine off(std::uint64_t seed) const {
    std::mt19937_64 random(seed * 2862933555777941757ULL + 3037000493ULL);
    const auto in = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    LimitedMachine m = *this;
    m.unbalance *= std::pow(2.0, in(-1, 1));
    m.unbalance_angle += in(-0.3, 0.3);
    m.stiffness *= 1 + in(-0.2, 0.2);
    m.damping *= 1 + in(-0.3, 0.3);
    m.gain *= 1 + in(-0.1, 0.1);
    m.second_hertz *= 1 + in(-0.03, 0.03);
    m.force_reached *= in(0.85, 1);
    m.slew *= in(0.9, 1.2);
    m.whirling = in(0, 1) < 0.7;
    const double way = in(0, 1);
    if (way < 0.25) {  // run-up
      std::swap(m.from, m.to);
      m.whirling = false;
    } else if (way < 0.4) {  // dwell near the critical speed
      m.from = m.to = in(0.85, 1.15) * m.critical();
    }
    return m;
  }
};

/// One run: read, write, advance once per millisecond.
class LimitedRig {
 public:
  static constexpr double kTick = 1e-3;
  static constexpr int kSteps = 8;

  LimitedRig(const LimitedMachine& machine, std::uint64_t seed) : m_(machine), random_(seed * 99991 + 17) {
    measure_vectors();
    s_.speed = m_.from;
    if (m_.whirling && m_.from > 0) {
      const double w = m_.from;
      const Complex stiff{m_.stiffness - m_.mass * w * w, m_.damping * w};
      s_.z = std::polar(m_.unbalance, m_.unbalance_angle) * m_.mass * w * w / stiff;
      s_.v = Complex{0, w} * s_.z;
    }
    s_.seen = seen(s_, std::polar(1.0, s_.angle));
    sent_.fill({});
    turn_ = 0, rate_ = m_.from;
    sense();
  }
  long ticks() const { return std::lround((m_.ramp + m_.still) / kTick); }
  bool done() const { return tick_ >= ticks(); }
  double time() const { return static_cast<double>(tick_) * kTick; }
  Measurement read() const noexcept { return reading_; }
  void write(const Command& u) noexcept { sent_[slot(tick_)] = {u.ux, u.uy}; }
  void advance() noexcept {
    const double h = kTick / kSteps;
    const double early = m_.age + m_.jitter * (2 * uniform() - 1);
    const int look = std::clamp(kSteps - static_cast<int>(std::lround(early / h)), 0, kSteps);
    for (int i = 0; i < kSteps; ++i) {
      if (i == look) look_now();
      amplify(time() + i * h, h);
      step(time() + i * h, h);
    }
    if (look == kSteps) look_now();
    ++tick_;
    sent_[slot(tick_)] = sent_[slot(tick_ - 1)];
    sense();
  }
  LimitedMachine& machine() { return m_; }
  std::complex<double> z() const { return s_.z; }          ///< of the disc, m
  std::complex<double> force() const { return s_.force; }  ///< acting, N
  std::complex<double> second() const { return s_.p; }     ///< second mode as the sensors see it, m
  double speed() const { return s_.speed; }

 private:
  using Complex = std::complex<double>;
  struct State {
    Complex z, v, p, q, force, seen;
    double angle = 0, speed = 0;
  };
  static std::size_t slot(long tick) { return static_cast<std::size_t>(tick + 64) % 64; }

  /// `turn`: e^{i angle}.
  Complex seen(const State& s, Complex turn) const {
    return s.z + s.p + turn * (runout_ + 0.4 * turn * std::conj(runout_));
  }
  void measure_vectors() {
    unbalance_ = std::polar(m_.unbalance, m_.unbalance_angle), runout_ = std::polar(m_.runout, m_.runout_angle);
  }
  double reference(double t) const {
    const double part = std::clamp(t / m_.ramp, 0.0, 1.0);
    return m_.from + part * (m_.to - m_.from);
  }
  // Delay, limit, slew and play, then the lag that `step` integrates.
  void amplify(double t, double h) noexcept {
    double since = t - m_.delay;
    if (t >= m_.late_from) since -= m_.late_by;
    Complex asked = 0;
    if (since > -1e-9) {
      const long k = static_cast<long>(since / kTick + 1e-6);
      if (k > tick_ - 60) asked = sent_[slot(k)];
    }
    const auto axis = [&](double now, double& slewed, double& played) {
      const double most = m_.force_reached, want = std::clamp(now, -most, most);
      slewed += std::clamp(want - slewed, -m_.slew * h, m_.slew * h);
      played = std::clamp(played, slewed - 0.5 * m_.hysteresis, slewed + 0.5 * m_.hysteresis);
      return played;
    };
    Complex force =
        m_.gain * Complex{axis(asked.real(), slewed_[0], played_[0]), axis(asked.imag(), slewed_[1], played_[1])};
    if (t >= m_.wrong_from) force = m_.wrong * Complex{force.real(), m_.wrong_y * force.imag()};
    target_ = force;
  }
  State rates(const State& s, double t) const {
    State d;
    const double w = s.speed, r2 = std::norm(s.z), second = 2 * std::numbers::pi * m_.second_hertz;
    const double torque = m_.drive * (reference(t) - w);
    const Complex turn = turned_ * small_turn(s.angle - s_.angle);
    const Complex arm = unbalance_ * turn;
    d.angle = w;
    // The drive carries the disc's centre of mass round the shaft: its acceleration brakes and drives the shaft.
    const Complex inner = (s.force - (m_.stiffness + m_.cubic * r2) * s.z - m_.damping * s.v) / m_.mass;
    const double pull = m_.mass * (std::conj(arm) * inner).imag();
    d.speed = (torque - pull) / m_.inertia;
    if (m_.from == 0 && m_.to == 0) d.speed = 0;
    const Complex turning = arm * Complex{w * w, -d.speed};
    d.z = s.v;
    d.v = inner + turning;
    d.p = s.q;
    d.q = -second * second * s.p - Complex{2 * m_.second_damping * second, -m_.second_split * w} * s.q +
          m_.second_share / m_.mass * s.force + m_.second_unbalance * m_.second_share * turning;
    d.force = (target_ - s.force) / m_.lag;
    d.seen = (seen(s, turn) - s.seen) / m_.sensor_lag;
    return d;
  }
  static State along(const State& s, const State& d, double h) {
    State n = s;
    n.z += h * d.z, n.v += h * d.v, n.p += h * d.p, n.q += h * d.q, n.force += h * d.force, n.seen += h * d.seen;
    n.angle += h * d.angle, n.speed += h * d.speed;
    return n;
  }
  void step(double t, double h) noexcept {
    // The lags are shorter than what four stages bear at this step: in parts.
    const int parts = std::max(1, static_cast<int>(std::ceil(h / (1.5 * std::min(m_.lag, m_.sensor_lag)))));
    const double dt = h / parts;
    measure_vectors();
    for (int i = 0; i < parts; ++i, t += dt) {
      turned_ = std::polar(1.0, s_.angle);
      const State a = rates(s_, t), b = rates(along(s_, a, 0.5 * dt), t + 0.5 * dt);
      const State c = rates(along(s_, b, 0.5 * dt), t + 0.5 * dt), d = rates(along(s_, c, dt), t + dt);
      s_ = along(along(along(along(s_, a, dt / 6), b, dt / 3), c, dt / 3), d, dt / 6);
    }
    if (s_.speed < 0) s_.speed = 0;
  }
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double gauss() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }
  void look_now() noexcept {
    looked_ = {std::clamp(s_.seen.real() + m_.noise * gauss(), -m_.clip, m_.clip),
               std::clamp(s_.seen.imag() + m_.noise * gauss(), -m_.clip, m_.clip)};
  }
  void sense() noexcept {
    // 4096 lines; a tracking loop with both poles at 40 1/s.
    const double line = 2 * std::numbers::pi / 4096, angle = (std::floor(s_.angle / line) + 0.5) * line;
    if (tick_ == 0) {
      look_now();
      turn_ = angle;
    } else {
      turn_ += kTick * rate_;
      const double error = angle - turn_;
      turn_ += 0.12 * error, rate_ += kTick * change_ + 4.8 * error, change_ += 64 * error;
    }
    reading_ = {time(), looked_.real(), looked_.imag(), angle, std::max(rate_, 0.0), change_, true};
    if (s_.speed == 0) reading_.omega = reading_.omega_dot = 0;
  }

  LimitedMachine m_;
  std::mt19937_64 random_;
  State s_;
  std::array<Complex, 64> sent_{};
  Complex target_, looked_;
  Complex turned_, unbalance_, runout_;  // of a step: its first angle; of the machine
  std::array<double, 2> slewed_{}, played_{};
  Measurement reading_;
  long tick_ = 0;
  double turn_ = 0, rate_ = 0, change_ = 0;
};

}  // namespace whirl::testing
