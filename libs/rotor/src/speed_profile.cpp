#include "whirl/rotor/speed_profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/core/integrate.hpp"

namespace whirl {

namespace {

// Angle turned from t = 0 to t by omega(t) = (w + a t)(1 + r sin(n t + p)), t <= piece length.
double turned(double w, double a, double t, double r, double n, double p) {
  const double smooth = w * t + 0.5 * a * t * t;
  if (r == 0) return smooth;
  const double ripple = (w * std::cos(p) - (w + a * t) * std::cos(n * t + p)) / n +
                        a * (std::sin(n * t + p) - std::sin(p)) / (n * n);
  return smooth + r * ripple;
}

AngleSignal empty_signal(double dt, Eigen::Index samples) {
  if (!(dt > 0)) throw Error::in_field("dt", fmt::format("{:g} s", dt), "above 0");
  if (samples < 1) throw Error::in_field("samples", fmt::format("{}", samples), "at least 1");
  AngleSignal s;
  s.dt = dt;
  const Eigen::Index n = 2 * samples - 1;
  s.beta.resize(n);
  s.omega.resize(n);
  s.alpha.resize(n);
  return s;
}

}  // namespace

AngleState SpeedProfile::at(double t) const {
  const double slope = (omega_end - omega_start) / ramp_time;
  const double ramp_start = dwell_start, ramp_end = dwell_start + ramp_time;
  double beta = beta_start;
  double piece_start = 0, w = omega_start, a = 0;
  const auto phase = [&](double time) { return ripple_omega * time + ripple_phase; };
  if (t >= ramp_start) {
    beta += turned(omega_start, 0, dwell_start, ripple, ripple_omega, phase(0));
    piece_start = ramp_start;
    a = slope;
  }
  if (t >= ramp_end) {
    beta += turned(omega_start, slope, ramp_time, ripple, ripple_omega, phase(ramp_start));
    piece_start = ramp_end;
    w = omega_end;
    a = 0;
  }
  const double s = t - piece_start;
  const double linear = w + a * s;
  const double sine = std::sin(phase(t)), cosine = std::cos(phase(t));
  return {beta + turned(w, a, s, ripple, ripple_omega, phase(piece_start)), linear * (1 + ripple * sine),
          a * (1 + ripple * sine) + linear * ripple * ripple_omega * cosine};
}

SpeedProfile SpeedProfile::without_ripple() const {
  SpeedProfile p = *this;
  p.ripple = 0;
  return p;
}

void SpeedProfile::check() const {
  constexpr double kLong = 1e6, kFast = 1e5;
  require_range("profile.omega_start", omega_start, -kFast, kFast, "rad/s");
  require_range("profile.omega_end", omega_end, -kFast, kFast, "rad/s");
  require_range("profile.dwell_start", dwell_start, 0, kLong, "s");
  require_range("profile.dwell_end", dwell_end, 0, kLong, "s");
  require_range("profile.ramp_time", ramp_time, 1e-6, kLong, "s");
  require_range("profile.ripple", ripple, 0, 1);
  if (ripple > 0) require_range("profile.ripple_omega", ripple_omega, 1e-3, kFast, "rad/s");
}

SpeedProfile SpeedProfile::run_down(double omega, double ramp_time, double standstill) {
  SpeedProfile p;
  p.omega_start = omega;
  p.ramp_time = ramp_time;
  p.dwell_end = standstill;
  p.check();
  return p;
}

SpeedProfile SpeedProfile::run_up(double omega, double ramp_time, double dwell) {
  SpeedProfile p;
  p.omega_end = omega;
  p.ramp_time = ramp_time;
  p.dwell_end = dwell;
  p.check();
  return p;
}

AngleSignal angle_signal(const SpeedProfile& profile, double dt, Eigen::Index samples) {
  profile.check();
  if (samples == 0 && dt > 0) samples = std::lround(profile.duration() / dt);
  AngleSignal signal = empty_signal(dt, samples);
  for (Eigen::Index i = 0; i < signal.beta.size(); ++i) {
    const AngleState a = profile.at(0.5 * dt * static_cast<double>(i));
    signal.beta[i] = a.beta;
    signal.omega[i] = a.omega;
    signal.alpha[i] = a.alpha;
  }
  return signal;
}

double TorqueModel::torque(double omega) const {
  if (omega == 0) return motor - std::clamp(motor, -coulomb, coulomb);
  return motor - motor_slope * omega - std::copysign(coulomb, omega) - viscous * omega - drag * omega * std::abs(omega);
}

AngleSignal torque_driven_angle(const TorqueModel& torque, double inertia, double beta0, double omega0, double dt,
                                Eigen::Index samples) {
  if (!(inertia > 0)) throw Error::in_field("inertia", fmt::format("{:g} kg m^2", inertia), "above 0");
  AngleSignal signal = empty_signal(dt, samples);
  Eigen::Vector2d state(beta0, omega0);
  const auto rate = [&](double, const Eigen::Vector2d& s) {
    return Eigen::Vector2d(s[1], torque.torque(s[1]) / inertia);
  };
  for (Eigen::Index i = 0; i < signal.beta.size(); ++i) {
    signal.beta[i] = state[0];
    signal.omega[i] = state[1];
    signal.alpha[i] = torque.torque(state[1]) / inertia;
    // Within the step that would reverse it Coulomb friction stops the rotor: constant deceleration to that instant.
    const double last = state[1], alpha = signal.alpha[i];
    if (std::abs(torque.motor) <= torque.coulomb && last * (last + 0.5 * dt * alpha) <= 0) {
      state = Eigen::Vector2d(state[0] + (last != 0 ? -0.5 * last * last / alpha : 0), 0);
    } else {
      state = rk4_step(rate, 0.0, state, 0.5 * dt);
    }
  }
  return signal;
}

}  // namespace whirl
