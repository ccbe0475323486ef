#include "whirl/rotor/speed_profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/core/integrate.hpp"

namespace whirl::rotor {

namespace {

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

// Integral of (w + a s) r sin(n t + p) over t: r [-(w + a s) cos(n t + p) / n + a sin(n t + p) / n^2], s = t
// - start.
AngleFunction::AngleFunction(const SpeedProfile& p)
    : ripple_(p.ripple), ripple_omega_(p.ripple != 0 ? p.ripple_omega : 1), ripple_phase_(p.ripple_phase) {
  const double ramp_end = p.dwell_start + p.ramp_time;
  pieces_[0] = {0, p.omega_start, 0, 0};
  pieces_[1] = {p.dwell_start, p.omega_start, (p.omega_end - p.omega_start) / p.ramp_time, 0};
  pieces_[2] = {ramp_end, p.omega_end, 0, 0};
  const auto primitive = [&](const Piece& piece, double t) {
    const double s = t - piece.start, phase = ripple_omega_ * t + ripple_phase_;
    return s * (piece.speed + 0.5 * piece.slope * s) +
           ripple_ *
               (piece.slope * std::sin(phase) / ripple_omega_ - (piece.speed + piece.slope * s) * std::cos(phase)) /
               ripple_omega_;
  };
  double angle = p.beta_start;
  for (int i = 0; i < 3; ++i) {
    if (i > 0) angle = pieces_[i - 1].offset + primitive(pieces_[i - 1], pieces_[i].start);
    pieces_[i].offset = angle - primitive(pieces_[i], pieces_[i].start);
  }
}

AngleState AngleFunction::operator()(double t) const {
  const Piece& piece = t >= pieces_[2].start ? pieces_[2] : (t >= pieces_[1].start ? pieces_[1] : pieces_[0]);
  const double s = t - piece.start, linear = piece.speed + piece.slope * s;
  const double smooth = piece.offset + s * (piece.speed + 0.5 * piece.slope * s);
  if (ripple_ == 0) return {smooth, linear, piece.slope};
  const double phase = ripple_omega_ * t + ripple_phase_, sine = std::sin(phase), cosine = std::cos(phase);
  return {smooth + ripple_ * (piece.slope * sine / ripple_omega_ - linear * cosine) / ripple_omega_,
          linear * (1 + ripple_ * sine),
          piece.slope * (1 + ripple_ * sine) + linear * ripple_ * ripple_omega_ * cosine};
}

AngleState SpeedProfile::at(double t) const { return AngleFunction(*this)(t); }

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
  const AngleFunction angle(profile);
  for (Eigen::Index i = 0; i < signal.beta.size(); ++i) {
    const AngleState a = angle(0.5 * dt * static_cast<double>(i));
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

}  // namespace whirl::rotor
