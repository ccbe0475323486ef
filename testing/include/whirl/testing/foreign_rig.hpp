#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/testing/control/small_turn.hpp"

/// A machine that libs/rig does not know: forces written one by one in real coordinates, fifth-order Dormand-Prince
/// steps of 50 us, its own encoder, hold and delay. Drawn from a seed. Nothing here knows RotorModel or RigParameters.
namespace whirl::testing {

/// A further mode in its own coordinates (p, q): the force at the actuator drives it, the sensor sees it.
struct ForeignMode {
  double hertz = 0, damping = 0;
  double split = 0;         ///< gyroscopic: backward and forward frequency differ by split * speed
  double actuator = 0;      ///< shape at the actuator, relative to the disc's own motion
  double sensor = 0;        ///< shape at the sensor
  double inverse_mass = 0;  ///< 1/kg
  double start = 0;         ///< deflection of both coordinates at t = 0, as the sensor sees it, m
  /// Share of the actuator's force that the loop sees, relative to the disc.
  double participation(double disc_mass) const { return actuator * sensor * inverse_mass * disc_mass; }
};

struct ForeignMachine {
  double mass = 1.5, stiffness = 8500, damping = 1.5;  ///< kg, N/m, N s/m
  double cubic = 0, quintic = 0, quadratic = 0;        ///< N/m^3, N/m^5 radial; N/m^2 along x
  double gyroscopic = 0;                               ///< N s/m per rad/s along i z'
  double unbalance = 300e-6, unbalance_angle = 0;      ///< m, rad
  std::array<ForeignMode, 2> modes{};
  double inertia = 0.05;                                 ///< kg m^2, about the axis; torque coupling by the unbalance
  double top = 190, down = 13, still = 1;                ///< rad/s; s from there to the last speed; s at it
  double bottom = 0;                                     ///< the last speed, rad/s: above `top` in a run-up
  double gain = 1, cross = 0, lag = 5e-4, delay = 1e-3;  ///< of the actuators; force of one axis on the other; s
  double force_limit = 40;                               ///< N
  double sensor_cross = 0;                               ///< share of y in the reading of x and back
  std::array<double, 3> runout{}, runout_phase{};        ///< m, rad
  double noise = 0.7e-6, age = 0.25e-3;                  ///< m rms; age of a reading, s
  int counts = 1024;                                     ///< encoder lines per turn
  bool from_rest = false;                                ///< the disc is at rest when the run begins, at top speed

  double critical() const { return std::sqrt(stiffness / mass); }

  /// Another machine for every seed. `participation`: bound of the signed participation of the modes.
  static ForeignMachine draw(std::uint64_t seed, double participation = 0.3) {
    std::mt19937_64 random(seed * 7919 + 13);
    const auto in = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    ForeignMachine m;
    m.mass = 0.5 * std::pow(40, in(0, 1));
    const double w = 2 * std::numbers::pi * in(9, 15);
    m.stiffness = m.mass * w * w;
    m.damping = 2 * in(0.005, 0.02) * m.mass * w;
    m.unbalance = in(100e-6, 350e-6);
    m.unbalance_angle = in(-3, 3);
    const double far = 6e-3;  // m: sizes of the nonlinear forces are those at this deflection
    m.cubic = in(0, 0.06) * m.stiffness / (far * far);
    m.quintic = in(0, 0.03) * m.stiffness / std::pow(far, 4);
    m.quadratic = in(-0.02, 0.02) * m.stiffness / far;
    m.gyroscopic = in(0, 0.01) * m.mass;
    m.top = 2.5 * w;
    m.inertia = m.mass * in(0.005, 0.02);
    for (std::size_t i = 0; i < 2; ++i) {
      ForeignMode& mode = m.modes[i];
      mode.hertz = i == 0 ? in(3.2, 5) * w / (2 * std::numbers::pi) : in(100, 170);
      mode.damping = in(0.006, 0.02);
      mode.split = in(0, 0.15);
      mode.actuator = in(0.5, 1);
      mode.sensor = in(0.5, 1) * (in(0, 1) < 0.5 ? -1 : 1);
      const double most = participation / (i == 0 ? 1 : 2);
      mode.inverse_mass = in(0.2, 1) * most / std::abs(mode.actuator * mode.sensor) / m.mass;
    }
    m.gain = in(0.9, 1.1);
    m.cross = in(-0.05, 0.05);
    m.sensor_cross = in(-0.02, 0.02);
    m.lag = in(2e-4, 1e-3);
    m.delay = 50e-6 * std::floor(in(1e-3, 2.5e-3) / 50e-6);
    m.force_limit = 1.5 * m.mass * m.unbalance * m.top * m.top;
    for (std::size_t i = 0; i < 3; ++i)
      m.runout[i] = in(2e-6, 12e-6) / (1.0 + static_cast<double>(i)), m.runout_phase[i] = in(-3, 3);
    return m;
  }
};

/// One run of the machine: read, write, advance once per millisecond, as the loop wants it.
class ForeignRig {
 public:
  static constexpr double kTick = 1e-3, kStep = 50e-6;
  static constexpr int kSteps = 20;

  ForeignRig(const ForeignMachine& machine, std::uint64_t seed) : m_(machine), random_(seed) {
    settle();
    commands_.assign(static_cast<std::size_t>(ticks() + 2), {});
    sense();
  }
  long ticks() const { return std::lround((m_.down + m_.still) / kTick); }
  bool done() const { return tick_ >= ticks(); }
  Measurement read() const noexcept { return reading_; }
  void write(const Command& u) noexcept { commands_[static_cast<std::size_t>(tick_)] = u; }
  void advance() noexcept {
    for (int i = 0; i < kSteps; ++i) {
      if (i == kSteps - std::lround(m_.age / kStep)) look();
      dormand_prince();
    }
    ++tick_;
    sense();
  }
  ForeignMachine& machine() { return m_; }  ///< to change it while it runs
  double x() const { return s_[0]; }        ///< of the disc, m
  double y() const { return s_[1]; }
  double angle() const { return s_[12]; }
  double speed() const { return s_[13]; }
  double command_x() const { return last_.ux; }  ///< acting, before lag, N
  double command_y() const { return last_.uy; }

 private:
  // x, y, x', y'; p1, q1, p1', q1'; p2, q2, p2', q2'; angle, speed; force x, y
  using State = std::array<double, 16>;

  Command acting(double t) const {
    const double since = t - m_.delay;
    if (since < 0) return {};
    const auto k = static_cast<std::size_t>(since / kTick + 1e-6);
    const Command u = commands_[std::min(k, commands_.size() - 1)];
    const double fx = std::clamp(u.ux, -m_.force_limit, m_.force_limit);
    const double fy = std::clamp(u.uy, -m_.force_limit, m_.force_limit);
    return {m_.gain * (fx + m_.cross * fy), m_.gain * (fy - m_.cross * fx)};
  }
  State rates(const State& s, const Command& u, double slowing) const {
    State d{};
    const std::complex<double> turn = turned_ * small_turn(s[12] - s_[12]);
    const double x = s[0], y = s[1], vx = s[2], vy = s[3], w = s[13], c = turn.real(), sn = turn.imag(),
                 r2 = x * x + y * y;
    const double k = m_.stiffness + m_.cubic * r2 + m_.quintic * r2 * r2;
    const double ax = (s[14] - k * x - m_.quadratic * x * x - m_.damping * vx - m_.gyroscopic * w * vy) / m_.mass +
                      m_.unbalance * (w * w * c + slowing * sn);
    const double ay = (s[15] - k * y - m_.damping * vy + m_.gyroscopic * w * vx) / m_.mass +
                      m_.unbalance * (w * w * sn - slowing * c);
    d[0] = vx, d[1] = vy, d[2] = ax, d[3] = ay;
    for (std::size_t i = 0; i < 2; ++i) {
      const ForeignMode& mode = m_.modes[i];
      const double w0 = 2 * std::numbers::pi * mode.hertz, g = mode.split * w, b = mode.actuator * mode.inverse_mass;
      const double* q = &s[4 + 4 * i];
      double* dq = &d[4 + 4 * i];
      dq[0] = q[2], dq[1] = q[3];
      dq[2] = -w0 * w0 * q[0] - 2 * mode.damping * w0 * q[2] - g * q[3] + b * s[14];
      dq[3] = -w0 * w0 * q[1] - 2 * mode.damping * w0 * q[3] + g * q[2] + b * s[15];
    }
    d[12] = w;
    // The unbalance takes torque out of the drive: a ripple of the speed at 1x.
    d[13] = w > 0 || slowing > 0 ? slowing + m_.mass * m_.unbalance / m_.inertia * (ax * sn - ay * c) * 0.1 : 0;
    d[14] = (u.ux - s[14]) / m_.lag, d[15] = (u.uy - s[15]) / m_.lag;
    return d;
  }
  void dormand_prince() noexcept {
    const double t = static_cast<double>(step_) * kStep, slowing = t < m_.down ? (m_.bottom - m_.top) / m_.down : 0;
    last_ = acting(t + 1e-9);
    turned_ = std::polar(1.0, s_[12] + m_.unbalance_angle);
    const auto at = [&](std::initializer_list<std::pair<double, const State*>> parts) {
      State s = s_;
      for (const auto& [a, k] : parts) {
        for (std::size_t i = 0; i < s.size(); ++i) s[i] += kStep * a * (*k)[i];
      }
      return s;
    };
    const State k1 = rates(s_, last_, slowing);
    const State k2 = rates(at({{0.2, &k1}}), last_, slowing);
    const State k3 = rates(at({{3.0 / 40, &k1}, {9.0 / 40, &k2}}), last_, slowing);
    const State k4 = rates(at({{44.0 / 45, &k1}, {-56.0 / 15, &k2}, {32.0 / 9, &k3}}), last_, slowing);
    const State k5 =
        rates(at({{19372.0 / 6561, &k1}, {-25360.0 / 2187, &k2}, {64448.0 / 6561, &k3}, {-212.0 / 729, &k4}}), last_,
              slowing);
    const State k6 = rates(at({{9017.0 / 3168, &k1},
                               {-355.0 / 33, &k2},
                               {46732.0 / 5247, &k3},
                               {49.0 / 176, &k4},
                               {-5103.0 / 18656, &k5}}),
                           last_, slowing);
    s_ = at({{35.0 / 384, &k1}, {500.0 / 1113, &k3}, {125.0 / 192, &k4}, {-2187.0 / 6784, &k5}, {11.0 / 84, &k6}});
    ++step_;
    if (static_cast<double>(step_) * kStep >= m_.down) s_[13] = m_.bottom;
  }
  void settle() {
    // Steady whirl at the top speed of the linear disc; the rest dies out.
    const double w = m_.top, re = m_.stiffness - m_.mass * w * w, im = m_.damping * w;
    const double size = m_.mass * m_.unbalance * w * w / std::hypot(re, im),
                 angle = m_.unbalance_angle - std::atan2(im, re);
    s_[13] = w;
    if (!m_.from_rest)
      s_[0] = size * std::cos(angle), s_[1] = size * std::sin(angle), s_[2] = -w * s_[1], s_[3] = w * s_[0];
    for (std::size_t i = 0; i < 2; ++i) {
      if (m_.modes[i].start != 0) s_[4 + 4 * i] = s_[5 + 4 * i] = m_.modes[i].start / m_.modes[i].sensor;
    }
    look();
  }
  double gauss() {
    const double a = (static_cast<double>(random_() >> 11) + 0.5) * 0x1p-53,
                 b = static_cast<double>(random_() >> 11) * 0x1p-53;
    return std::sqrt(-2 * std::log(a)) * std::cos(2 * std::numbers::pi * b);
  }
  // The reading that the next tick gets.
  void look() {
    double x = s_[0], y = s_[1];
    for (std::size_t i = 0; i < 2; ++i)
      x += m_.modes[i].sensor * s_[4 + 4 * i], y += m_.modes[i].sensor * s_[5 + 4 * i];
    for (std::size_t i = 0; i < 3; ++i) {
      const double a = static_cast<double>(i + 1) * s_[12] + m_.runout_phase[i];
      x += m_.runout[i] * std::cos(a), y += m_.runout[i] * std::sin(a);
    }
    seen_ = {x + m_.sensor_cross * y + m_.noise * gauss(), y + m_.sensor_cross * x + m_.noise * gauss()};
  }
  void sense() {
    const double lines = m_.counts / (2 * std::numbers::pi), angle = std::floor(s_[12] * lines) / lines + 0.5 / lines;
    if (tick_ == 0) turn_ = angle, rate_ = s_[13];
    // A tracking loop with its poles at 30 1/s, fed with the counts.
    const double error = angle - (turn_ + kTick * rate_);
    if (tick_ > 0) {
      turn_ += kTick * rate_ + 0.09 * error;
      rate_ += kTick * change_ + 2.7 * error;
      change_ += 27 * error;
    }
    reading_ = {static_cast<double>(tick_) * kTick, seen_.ux, seen_.uy, angle, std::max(rate_, 0.0), change_, true};
    if (s_[13] == 0) reading_.omega = reading_.omega_dot = 0;
  }

  ForeignMachine m_;
  std::mt19937_64 random_;
  State s_{};
  std::vector<Command> commands_;
  std::complex<double> turned_;  // the unbalance at the beginning of the step
  Command last_, seen_;
  Measurement reading_;
  long tick_ = 0, step_ = 0;
  double turn_ = 0, rate_ = 0, change_ = 0;
};

/// The files a laboratory hands over: run-down without control, pull test, five hammer blows at the actuator seen by
/// an accelerometer at the sensor, and the data sheets as TOML. In `folder`: rundown.csv, pull.csv, blow_1..5.csv,
/// lab.toml.
inline void write_laboratory(const ForeignMachine& m, const std::filesystem::path& folder, std::uint64_t seed) {
  std::filesystem::create_directories(folder);
  const auto open = [&](const std::string& name) {
    std::ofstream out(folder / name);
    out.precision(12);
    return out;
  };
  {
    std::ofstream out = open("rundown.csv");
    out << "t_s,x_mm,y_mm,beta_rad\n";
    ForeignRig rig(m, seed);
    for (; !rig.done(); rig.advance()) {
      const Measurement r = rig.read();
      out << r.t << ',' << 1e3 * r.x << ',' << 1e3 * r.y << ',' << r.beta << '\n';
    }
  }
  {
    std::ofstream out = open("pull.csv");
    out << "deflection_mm,force_N\n";
    for (int i = 1; i <= 16; ++i) {
      const double x = 0.4e-3 * i;
      out << 1e3 * x << ',' << m.stiffness * x + m.cubic * x * x * x + m.quintic * std::pow(x, 5) << '\n';
    }
  }
  std::mt19937_64 random(seed + 5);
  for (int blow = 1; blow <= 5; ++blow) {
    std::ofstream out = open("blow_" + std::to_string(blow) + ".csv");
    out << "t_s,force_N,acc_x_m_s2\n";
    // Three oscillators in modal form, hit by a half sine of 3 ms.
    struct Mode {
      double w, z, drive, seen, q = 0, v = 0;
    };
    std::vector<Mode> all{{m.critical(), m.damping / (2 * m.mass * m.critical()), 1 / m.mass, 1}};
    for (const ForeignMode& mode : m.modes) {
      all.push_back({2 * std::numbers::pi * mode.hertz, mode.damping, mode.actuator * mode.inverse_mass, mode.sensor});
    }
    const double h = 1 / 2048.0;
    const int fine = 16;
    for (int k = 0; k < 16384; ++k) {
      double a = 0, f = 0;
      for (int i = 0; i < fine; ++i) {
        const double t = (k + static_cast<double>(i) / fine) * h, dt = h / fine;
        f = t > 0.05 && t < 0.053 ? 80 * std::sin(std::numbers::pi * (t - 0.05) / 0.003) : 0;
        a = 0;
        for (Mode& o : all) {
          const double acc = f * o.drive - o.w * o.w * o.q - 2 * o.z * o.w * o.v;
          if (i == 0) a += o.seen * acc;
          o.v += dt * acc, o.q += dt * o.v;
        }
        if (i == 0) {
          const double n1 = static_cast<double>(random() >> 11) * 0x1p-53 - 0.5,
                       n2 = static_cast<double>(random() >> 11) * 0x1p-53 - 0.5;
          out << t << ',' << f + 0.01 * n1 << ',' << a + 0.02 * n2 << '\n';
        }
      }
    }
  }
  std::ofstream out = open("lab.toml");
  const double lag_hz = 1 / (2 * std::numbers::pi * m.lag);
  out << "[profile]\nstart_rpm = " << m.top * 30 / std::numbers::pi << "\nend_rpm = 0.0\nramp_s = " << m.down
      << "\ndwell_end_s = " << m.still << "\nripple_percent = 0.0\n[laser]\nnoise_um = " << 1e6 * m.noise
      << "\nlatency_ms = " << 1e3 * m.age << "\n[actuator]\nvoltage_limit_V = 10.0\nforce_N_V = " << m.force_limit / 10
      << "\nbandwidth_hz = " << lag_hz << "\ndelay_samples = " << std::lround(m.delay / 1e-3)
      << "\n[encoder]\ncounts = " << m.counts << "\n";
}

}  // namespace whirl::testing
