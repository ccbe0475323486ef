#include "tried_loop.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "whirl/control/controller.hpp"
#include "whirl/control/lateral_model.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::tuning {
namespace {

using Complex = std::complex<double>;
constexpr double kLost = 50e-3;  // m: no motion of a loop that holds
constexpr double kDecayed = 0.6;
constexpr double kMostGain = 8, kNear = 1.3;
constexpr int kMostDelay = 12;

/// Readings of a shaft at constant speed less their offset, forward and backward 1x parts, by least squares.
class Remainder {
 public:
  void reading(Complex z, double beta) noexcept {
    const Complex turn = control::unit_phasor(beta);
    const Eigen::Vector3cd row(1, turn, std::conj(turn));
    gram_ += row.conjugate() * row.transpose();
    right_ += row.conjugate() * z;
    power_ += std::norm(z);
    ++count_;
  }
  /// rms of an axis, m; `forward`: amplitude of the forward part, m.
  double rms(double& forward) const {
    // At standstill the three parts are one: the ridge shares it out.
    const Eigen::Matrix3cd ridge = (1e-9 * static_cast<double>(count_)) * Eigen::Matrix3cd::Identity();
    const Eigen::Vector3cd fit = (gram_ + ridge).ldlt().solve(right_);
    forward = std::abs(fit[1]);
    return std::sqrt(0.5 * std::max(0.0, power_ - fit.dot(right_).real()) / static_cast<double>(std::max(count_, 1L)));
  }

 private:
  Eigen::Matrix3cd gram_ = Eigen::Matrix3cd::Zero();
  Eigen::Vector3cd right_ = Eigen::Vector3cd::Zero();
  double power_ = 0;
  long count_ = 0;
};

}  // namespace

ForceRun run_window(const ControllerDesign& design, const std::shared_ptr<const rig::RigTables>& tables,
                    std::uint64_t seed, Eigen::Index window, const Eigen::VectorXcd* excitation) {
  control::Controller controller = control::make_controller(design);
  rig::VirtualRig rig(tables, {seed, {}});
  const rig::RigTruth truth(rig);
  const Eigen::Index ticks = rig.ticks(), first = ticks - window, middle = ticks - window / 2;
  Remainder early, late;
  ForceRun out{Eigen::VectorXcd::Zero(window)};
  for (Eigen::Index k = 0; k < ticks; ++k) {
    const Measurement m = rig.read();
    const auto answer = controller.step(m);
    Command c = answer ? *answer : Command{};
    if (k >= first) {
      out.force[k - first] = {c.ux, c.uy};
      (k < middle ? early : late).reading({m.x, m.y}, m.omega != 0 ? m.beta : 0);
    }
    if (excitation != nullptr) {
      const Complex d = (*excitation)[k % window];
      c.ux += d.real(), c.uy += d.imag();
    }
    rig.write(c);
    rig.advance();
    if (!(std::abs(truth.z()) < kLost)) {
      out.holds = false;
      return out;
    }
  }
  const VerdictLimits limits;
  double forward = 0;
  const double before = early.rms(forward), rest = late.rms(forward);
  out.holds = !(rest > std::max(limits.standing_rms, limits.standing_share * forward)) || rest < kDecayed * before;
  return out;
}

rig::RigParameters at_constant_speed(rig::RigParameters p, double omega, double duration) {
  p.profile = {.omega_start = omega, .omega_end = omega, .ramp_time = duration, .beta_start = p.profile.beta_start};
  for (rig::RigMode& mode : p.modes) mode.initial = 0;
  p.actuator.voltage_limit *= 1e3;
  p.actuator.current_limit = p.actuator.slew = 0;
  p.actuator.bits = p.laser.bits = 0;
  return p;
}

TriedLoop::TriedLoop(const ControllerDesign& design, const rig::RigParameters& rig, double omega,
                     const MarginOptions& o, std::uint64_t seed)
    : design_(design), rig_(at_constant_speed(rig, omega, o.settle + o.window)), options_(o), seed_(seed) {}

bool TriedLoop::holds(double gain, int delay) const {
  rig::RigParameters p = rig_;
  p.actuator.gain_error = (1 + p.actuator.gain_error) * gain - 1;
  p.actuator.extra_delay_samples += delay;
  const Eigen::Index window = std::lround(options_.window / design_.sample_time);
  return run_window(design_, rig::make_rig_tables(p), seed_, window, nullptr).holds;
}

/// The first factor at which it stops to hold, up to kMostGain; infinite: it holds all the way, or to `most`. Limit
/// cycles of sliding terms and adapted gains stand in islands, with a loop that holds beyond: steps of 2 %, 5 % far
/// away, so that none is passed over.
double TriedLoop::gain(double most) const {
  double low = 1, high = 1;
  do {
    low = high;
    high = std::min(kMostGain, high * (high < kNear ? 1.02 : 1.05));
    if (low >= std::min(most, kMostGain)) return kInfinity;
  } while (holds(high, 0));
  const double middle = std::sqrt(low * high);
  return holds(middle, 0) ? std::sqrt(middle * high) : std::sqrt(low * middle);
}

/// Half-way between the last whole sample with which it holds and the next; infinite: beyond kMostDelay or `most`.
double TriedLoop::delay(double most) const {
  const auto between = [&](int n) { return (n + 0.5) * design_.sample_time; };
  int n = 0;
  while (n < kMostDelay && between(n) < most && holds(1, n + 1)) ++n;
  return n < kMostDelay && between(n) < most ? between(n) : kInfinity;
}

void TriedLoop::verify(LoopMargins& m, bool follows, const Reach* reach) const {
  const double inside = std::min(1 + 0.9 * (m.gain_up - 1), kMostGain);
  if (follows || !holds(inside, 0)) m.gain_up = gain(reach ? reach->gain() : kInfinity), m.simulated = true;
  const double samples = m.delay / design_.sample_time;
  const int last = samples < kMostDelay ? static_cast<int>(std::floor(samples)) : kMostDelay;
  if (follows || (last > 0 && !holds(1, last)))
    m.delay = delay(reach ? reach->delay(design_.sample_time) : kInfinity), m.simulated = true;
}

Reach::Reach() : gain_(kInfinity), delay_(kInfinity) {}

double Reach::delay(double sample_time) const {
  return std::max<double>(delay_, VerdictLimits().delay_samples * sample_time);
}

void Reach::found(const LoopMargins& m) {
  const auto lower = [](std::atomic<double>& least, double value) {
    double seen = least;
    while (value < seen && !least.compare_exchange_weak(seen, value)) continue;
  };
  lower(gain_, std::max(m.gain_up, VerdictLimits().gain_up()));
  lower(delay_, m.delay);
}

}  // namespace whirl::tuning
