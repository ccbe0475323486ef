#include "whirl/testing/control/foreign_rig.hpp"

#include <algorithm>
#include <complex>
#include <fstream>
#include <numbers>
#include <string>

#include "whirl/testing/control/small_turn.hpp"

namespace whirl::testing {

ForeignMachine ForeignMachine::draw(std::uint64_t seed, double participation) {
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

Command ForeignRig::acting(double t) const {
  const double since = t - m_.delay;
  if (since < 0) return {};
  const auto k = static_cast<std::size_t>(since / kTick + 1e-6);
  const Command u = commands_[std::min(k, commands_.size() - 1)];
  const double fx = std::clamp(u.ux, -m_.force_limit, m_.force_limit);
  const double fy = std::clamp(u.uy, -m_.force_limit, m_.force_limit);
  return {m_.gain * (fx + m_.cross * fy), m_.gain * (fy - m_.cross * fx)};
}

namespace {

using State = std::array<double, 16>;

/// The machine while a step is taken: what its rates need, divided once.
struct Rates {
  Rates(const ForeignMachine& machine, const State& from, const Command& command, double change)
      : m(machine),
        begin(from[12]),
        u(command),
        slowing(change),
        turned(std::polar(1.0, from[12] + machine.unbalance_angle)) {
    for (std::size_t i = 0; i < 2; ++i) {
      const ForeignMode& mode = m.modes[i];
      const double w = 2 * std::numbers::pi * mode.hertz;
      stiff[i] = w * w, damp[i] = 2 * mode.damping * w, drive[i] = mode.actuator * mode.inverse_mass;
    }
  }
  State operator()(const State& s) const {
    State d;
    const std::complex<double> turn = turned * small_turn(s[12] - begin);
    const double x = s[0], y = s[1], vx = s[2], vy = s[3], w = s[13], c = turn.real(), sn = turn.imag(),
                 r2 = x * x + y * y;
    const double k = m.stiffness + m.cubic * r2 + m.quintic * r2 * r2;
    const double ax = (s[14] - k * x - m.quadratic * x * x - m.damping * vx - m.gyroscopic * w * vy) * per_mass +
                      m.unbalance * (w * w * c + slowing * sn);
    const double ay =
        (s[15] - k * y - m.damping * vy + m.gyroscopic * w * vx) * per_mass + m.unbalance * (w * w * sn - slowing * c);
    d[0] = vx, d[1] = vy, d[2] = ax, d[3] = ay;
    for (std::size_t i = 0; i < 2; ++i) {
      const double g = m.modes[i].split * w;
      const double* q = &s[4 + 4 * i];
      double* dq = &d[4 + 4 * i];
      dq[0] = q[2], dq[1] = q[3];
      dq[2] = -stiff[i] * q[0] - damp[i] * q[2] - g * q[3] + drive[i] * s[14];
      dq[3] = -stiff[i] * q[1] - damp[i] * q[3] + g * q[2] + drive[i] * s[15];
    }
    d[12] = w;
    // The unbalance takes torque out of the drive: a ripple of the speed at 1x.
    d[13] = w > 0 || slowing > 0 ? slowing + torque * (ax * sn - ay * c) : 0;
    d[14] = (u.ux - s[14]) * per_lag, d[15] = (u.uy - s[15]) * per_lag;
    return d;
  }

  const ForeignMachine& m;
  double begin;
  Command u;
  double slowing;
  std::complex<double> turned;  // the unbalance at the beginning of the step
  double per_mass = 1 / m.mass, per_lag = 1 / m.lag, torque = 0.1 * m.mass * m.unbalance / m.inertia;
  std::array<double, 2> stiff, damp, drive;
};

/// s + h sum_j by_j k_j.
template <class... K>
State moved(const State& s, double h, const std::array<double, sizeof...(K)>& by, const K&... k) {
  State out;
  for (std::size_t i = 0; i < s.size(); ++i) {
    std::size_t j = 0;
    double sum = 0;
    ((sum += by[j++] * k[i]), ...);
    out[i] = s[i] + h * sum;
  }
  return out;
}

}  // namespace

void ForeignRig::dormand_prince() noexcept {
  const double t = static_cast<double>(step_) * kStep, slowing = t < m_.down ? (m_.bottom - m_.top) / m_.down : 0;
  last_ = acting(t + 1e-9);
  const Rates rates(m_, s_, last_, slowing);
  const State k1 = rates(s_);
  const State k2 = rates(moved(s_, kStep, {0.2}, k1));
  const State k3 = rates(moved(s_, kStep, {3.0 / 40, 9.0 / 40}, k1, k2));
  const State k4 = rates(moved(s_, kStep, {44.0 / 45, -56.0 / 15, 32.0 / 9}, k1, k2, k3));
  const State k5 =
      rates(moved(s_, kStep, {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729}, k1, k2, k3, k4));
  const State k6 = rates(
      moved(s_, kStep, {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656}, k1, k2, k3, k4, k5));
  s_ = moved(s_, kStep, {35.0 / 384, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}, k1, k3, k4, k5, k6);
  // A force that has died out is none: numbers too small to be normal take a hundred times as long.
  for (const std::size_t force : {14, 15}) {
    if (std::abs(s_[force]) < 1e-100) s_[force] = 0;
  }
  ++step_;
  if (static_cast<double>(step_) * kStep >= m_.down) s_[13] = m_.bottom;
}

void ForeignRig::advance() noexcept {
  for (int i = 0; i < kSteps; ++i) {
    if (i == kSteps - std::lround(m_.age / kStep)) look();
    dormand_prince();
  }
  ++tick_;
  sense();
}

void ForeignRig::settle() {
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

double ForeignRig::gauss() {
  const double a = (static_cast<double>(random_() >> 11) + 0.5) * 0x1p-53,
               b = static_cast<double>(random_() >> 11) * 0x1p-53;
  return std::sqrt(-2 * std::log(a)) * std::cos(2 * std::numbers::pi * b);
}

void ForeignRig::look() {
  double x = s_[0], y = s_[1];
  for (std::size_t i = 0; i < 2; ++i) x += m_.modes[i].sensor * s_[4 + 4 * i], y += m_.modes[i].sensor * s_[5 + 4 * i];
  for (std::size_t i = 0; i < 3; ++i) {
    const double a = static_cast<double>(i + 1) * s_[12] + m_.runout_phase[i];
    x += m_.runout[i] * std::cos(a), y += m_.runout[i] * std::sin(a);
  }
  seen_ = {x + m_.sensor_cross * y + m_.noise * gauss(), y + m_.sensor_cross * x + m_.noise * gauss()};
}

void ForeignRig::sense() {
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

void write_laboratory(const ForeignMachine& m, const std::filesystem::path& folder, std::uint64_t seed) {
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
