#include "whirl/control/supervisor.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/control/supervision_numbers.hpp"

namespace whirl::control {
namespace {

// Times in s, rates in 1/s; the exported C has the same numbers (libs/deploy/c/supervisor.c).
constexpr double kNotch = 25, kOffset = 5, kLevelTime = 0.025, kStartTime = 0.12, kConfirmTime = 0.06, kWait = 0.06;
constexpr double kObserved = 0.05, kMismatchTime = 0.03, kMismatch = 0.35, kFloor = 20e-6, kEstimate = 0.03,
                 kFollow = 0.12;
constexpr double kSlowShare = 0.02, kQuiet = 0.3, kLetGo = 0.3, kTransient = 0.12, kFade = 0.02, kSensorFade = 0.01,
                 kSaturationTime = 0.05;
constexpr double kGrowing = 1.1, kLoud = 2, kOwnWait = 0.2, kFullStart = 0.09;
constexpr double kOften = 0.15, kLoudStart = 1.4;
constexpr double kSudden = 0.4, kKnown = 0.5;
constexpr double kCalm = 1, kTestFade = 2e-3, kTestReturn = 5e-3;
constexpr int kQuarter = 3;
constexpr double kDamping = 0.3;  // of the natural frequency: 0.15 of critical
constexpr double kWorse = 1.1, kTurning = 0.1, kDecayed = 0.8, kDecaying = 0.95, kFast = 3;

/// `now` moved to `target` by at most `most`.
double toward(double now, double target, double most) noexcept { return now + std::clamp(target - now, -most, most); }

constexpr double kGains[] = {1, 1, 0.5, 0.25, 0, 0, 0};
constexpr int kOwnStep = 4, kForceStep = 5, kTripStep = 6;

}  // namespace

std::string supervision_text(std::uint32_t word) {
  std::string steps, reasons;
  const auto add = [word](std::string& text, std::uint32_t bit, const char* name) {
    if ((word & bit) != 0) text += (text.empty() ? "" : ", ") + std::string(name);
  };
  add(steps, kAdaptationFrozen, "adaptation frozen");
  add(steps, kFeedforwardReplaced, "feedforward re-estimated");
  add(steps, kGainLowered, "gain lowered");
  add(steps, kFeedbackOff, "feedback off");
  add(steps, kForceOff, "force off");
  add(steps, kSupervisionTrip, "tripped");
  add(reasons, kGrowth, "growth of motion beside the synchronous one");
  add(reasons, kFeedforwardPhase, "wrong phase of the feedforward");
  add(reasons, kUnbalanceChanged, "unbalance changed");
  add(reasons, kSaturation, "force at its limit");
  add(reasons, kSensorLost, "sensor lost");
  add(reasons, kWorseThanOpen, "motion larger than without control");
  add(reasons, kForceLost, "the rotor does not follow the force: an actuator is lost");
  add(reasons, kForceReversed, "the rotor moves against the force: wrong sign");
  add(reasons, kForceLate, "the force acts too late");
  add(reasons, kForceTested, "force let go for some ms to tell an actuator from the unbalance");
  if (reasons.empty()) return steps;
  return (steps.empty() ? "watched" : steps) + " (" + reasons + ")";
}

Supervisor::Supervisor(const SupervisorSettings& settings) noexcept
    : settings_(settings),
      check_({settings.model, settings.eps, settings.sample_time, settings.level, settings.delay, settings.limit,
              settings.slew, settings.hysteresis}) {
  reset();
}

void Supervisor::reset() noexcept {
  started_ = follow_ = returned_ = false;
  motion_ = {};
  synchronous_ = offset_ = {};
  eps_ = quiet_ = used_ = settings_.eps;
  square_ = mark_ = time_ = above_ = wait_ = mismatch_ = worse_ = saturated_ = sudden_ = settle_ = calm_ = 0;
  gain_ = force_ = sensor_ = held_ = 1;
  blend_ = own_ = 0;
  late_ = 0;
  steps_ = 0;
  reasons_ = 0;
  check_.reset();
}

void Supervisor::observe(const SupervisorInput& in) noexcept {
  const double h = settings_.sample_time;
  if (!started_) {
    motion_ = {in.z, product({0, in.omega}, in.z), in.d};
    synchronous_ = product(in.z, std::conj(in.turn));
    started_ = true;
    check_.interrupt();
    return;
  }
  motion_ = predict_motion(settings_.model, motion_, in.a, in.half ? *in.half : unit_phasor(0.5 * in.omega * h), h);
  if (!in.fresh) return;
  const std::complex<double> e = in.z - motion_.z;
  // Poles at -p, -p and, for the disturbance that turns, i omega - p: (s^2 + l1 s + l2 + k1)(s - i omega) + l3.
  const double p = settings_.bandwidth;
  const std::complex<double> turning{p, in.omega};
  motion_.z += (3 * p * h) * e;
  motion_.v += h * product({3 * p * p - settings_.model.k1, p * in.omega}, e);
  motion_.d += (p * h) * product(product(turning, turning), e);
  const std::complex<double> rest = in.z - offset_ - product(synchronous_, in.turn);
  synchronous_ += (h * kNotch) * product(rest, std::conj(in.turn));
  offset_ += (h * kOffset) * rest;
  square_ += (h * (1 / kLevelTime)) * (std::norm(rest) - square_);
}

void Supervisor::judge_feedforward(const SupervisorInput& in) noexcept {
  const double h = settings_.sample_time, size = std::norm(in.forcing);
  const double slow = kSlowShare * settings_.model.k1;
  std::complex<double> now = eps_;
  if (size > slow * slow) now = (1 / size) * product(motion_.d, std::conj(in.forcing));
  eps_ += (h * (1 / kEstimate)) * (now - eps_);
  if (square_ < 0.25 * settings_.level * settings_.level) quiet_ += (h * (1 / kQuiet)) * (eps_ - quiet_);
  const double acts = std::norm(motion_.d), given = std::norm(in.d), floor = settings_.model.k1 * kFloor;
  const double limit = std::max(kMismatch * kMismatch * std::max(acts, given), floor * floor);
  const bool apart = settings_.fixed && in.fresh && std::norm(motion_.d - in.d) > limit;
  mismatch_ = apart && time_ > kObserved ? mismatch_ + h : 0;
  if (mismatch_ > kMismatchTime && !follow_ && steps_ == 0) {
    follow_ = true;
    wait_ = kTransient;
    const double along = product(motion_.d, std::conj(in.d)).real();
    const bool phase = along < 0 || along * along < 0.25 * acts * given;
    reasons_ |= phase ? kFeedforwardPhase : kUnbalanceChanged;
    // A force that is worse than none ends at once, another is moved from where it is.
    used_ = phase || acts < 0.25 * given ? 0 : settings_.eps;
  }
  // An integrator of what is left: stable for phase errors of the force up to 90 degrees, less the observer's 15.
  const bool lowered = settings_.fixed && steps_ > 0;
  const bool quiet = late_ <= 0 && (steps_ >= kOwnStep || lowered) && square_ < settings_.level * settings_.level;
  if ((follow_ && steps_ == 0) || quiet) used_ += (h * (1 / kFollow)) * (now - used_);
  if (follow_ || steps_ > 0) blend_ = toward(blend_, 1, h * (1 / kFade));
  // The gain comes back once: a motion that the law feeds returns with it, and is answered for good.
  calm_ = quiet && steps_ <= kQuarter ? calm_ + h : 0;
  if (calm_ > kCalm && !returned_) {
    returned_ = follow_ = true;
    steps_ = 0;
    wait_ = kTransient;
  }
}

void Supervisor::step_down(std::uint32_t reason) noexcept {
  // An estimate made while motion grew is not trusted: the last quiet one.
  if (settings_.fixed ? follow_ && steps_ > 0 : steps_ == 0) used_ = quiet_;
  reasons_ |= reason;
  const bool quick = square_ > kFast * kFast * settings_.level * settings_.level;
  // A fixed feedforward has no adaptation to freeze. The own damping is never left out.
  int next = steps_ + (quick ? 2 : 1);
  if (settings_.fixed && steps_ < kQuarter) next = kQuarter;
  if (settings_.carried && steps_ < kOwnStep) next = steps_ == 0 ? 1 : kOwnStep;
  steps_ = steps_ < kOwnStep ? std::min(next, kOwnStep) : std::min(next, kTripStep);
  wait_ = steps_ >= kForceStep ? 2 * kLetGo : steps_ == kOwnStep ? kOwnWait : kWait;
  above_ = worse_ = 0;
}

void Supervisor::judge_motion(const SupervisorInput& in) noexcept {
  const double h = settings_.sample_time, level = std::sqrt(square_);
  settle_ = std::max(0.0, settle_ - h);
  wait_ = std::max({0.0, wait_ - h, settle_});
  // At its limit the force damps nothing: the loop that feeds such a motion is opened before the disk gathers speed.
  // Without a feedforward the feedback has to catch the rotor first; with one no start is at its limit again and again.
  const bool full = saturated_ > 0.5 && level > kLoud * settings_.level;
  const bool starting = settings_.fixed && steps_ == 0 && time_ > kFullStart && time_ < kStartTime + kConfirmTime &&
                        wait_ <= 0 && saturated_ > kOften && level > kLoudStart * settings_.level;
  if (((full && time_ > (settings_.fixed ? kObserved : kFullStart)) || starting) && settle_ <= 0 &&
      steps_ <= kQuarter) {
    step_down(kGrowth);
    steps_ = kOwnStep;
    wait_ = kOwnWait;
  }
  // A gain that came back to a quiet rotor and brings the motion back.
  if (returned_ && steps_ == 0 && wait_ > 0 && settle_ <= 0 && !check_.let_go() && level > settings_.level) {
    step_down(kGrowth);
  }
  // What the law finds itself is on its way: no step for the transient of another unbalance.
  const double largest = std::max(std::norm(eps_), std::norm(quiet_));
  const bool sudden =
      !settings_.fixed && steps_ == 0 && time_ > kKnown && std::norm(eps_ - quiet_) > kMismatch * kMismatch * largest;
  sudden_ = sudden ? sudden_ + h : 0;
  if (sudden && sudden_ < kSudden) above_ = worse_ = 0;
  if (time_ < kStartTime || wait_ > 0 || (sudden && sudden_ < kSudden)) return;
  if (level > settings_.level) {
    if (above_ == 0) mark_ = level;
    if (steps_ <= kQuarter) mark_ = std::max(mark_, level);
    above_ += h;
  } else {
    above_ = 0;
  }
  if (above_ > kConfirmTime) {
    // Without feedback the rotor decays as slowly as it is damped: only growth is the controller's then.
    if (level > (steps_ == 0 ? kDecayed : steps_ > kQuarter ? kGrowing : kDecaying) * mark_) step_down(kGrowth);
    above_ = 0;
  }
  // The steady whirl of the model without control, with the larger of the two unbalances.
  const double now = std::sqrt(std::norm(synchronous_)), least = 0.25 * settings_.level;
  bool worse = in.omega * in.omega > kTurning * settings_.model.k1 && now > least;
  if (worse) {
    const double k = settings_.model.k1 - in.omega * in.omega, c = settings_.model.c * in.omega;
    const double beyond = (now - least) / kWorse;
    worse = beyond * beyond * std::max(k * k + c * c, 1e-12) >
            std::max(std::norm(eps_), std::norm(settings_.eps)) * std::norm(in.forcing);
  }
  worse_ = worse ? worse_ + h : 0;
  if (worse_ > kConfirmTime) step_down(kWorseThanOpen);
}

void Supervisor::judge_force(const SupervisorInput& in) noexcept {
  if (in.gap) check_.interrupt();
  const ForceFault fault = check_.step(in.z, in.fresh, in.a, in.forcing, in.saturated);
  if (check_.let_go()) {
    reasons_ |= kForceTested;
    wait_ = kTransient;
  }
  if (check_.changed()) {
    reasons_ |= kUnbalanceChanged;
    settle_ = kSudden;
    eps_ = check_.eps();
    if (settings_.fixed) {
      follow_ = true;
      used_ = eps_;
      blend_ = 1;
    }
  }
  if (fault == ForceFault::none) return;
  reasons_ |= fault == ForceFault::lost ? kForceLost : fault == ForceFault::reversed ? kForceReversed : kForceLate;
  if (fault == ForceFault::late) return let_go_late();
  steps_ = kTripStep;
}

/// A late force still acts: ended at once it would leave the rotor ringing into its next critical speed.
void Supervisor::let_go_late() noexcept {
  if (late_ > 0) return;
  if (steps_ < kOwnStep) used_ = settings_.fixed && !follow_ ? settings_.eps : quiet_;
  late_ = check_.late();
  steps_ = std::max(steps_, kForceStep);
  wait_ = supervision::late_fade;
}

Supervision Supervisor::step(const SupervisorInput& in) noexcept {
  const double h = settings_.sample_time;
  observe(in);
  time_ = std::min(time_ + h, 1.0);
  judge_feedforward(in);
  judge_motion(in);
  judge_force(in);
  saturated_ += (h * (1 / kSaturationTime)) * ((in.saturated ? 1.0 : 0.0) - saturated_);
  const bool limit = saturated_ > 0.5, lost = in.held >= 3;
  sensor_ = toward(sensor_, lost ? 0 : 1, h * (1 / kSensorFade));
  gain_ = toward(gain_, kGains[steps_], h * (1 / kFade));
  own_ = toward(own_, steps_ >= kOwnStep ? 1 : 0, h * (1 / kFade));
  force_ = toward(force_, steps_ >= kForceStep ? 0 : 1, h * (late_ > 0 ? 1 / supervision::late_fade : 1 / kLetGo));
  if (late_ > 0 && force_ <= 0) steps_ = kTripStep;
  held_ = check_.let_go() ? toward(held_, 0, h * (1 / kTestFade)) : toward(held_, 1, h * (1 / kTestReturn));

  Supervision out;
  out.gain = gain_ * sensor_;
  out.force = force_ * held_;
  out.own = own_;
  if (own_ > 0) out.damper = (-sensor_ * kDamping * std::sqrt(std::max(settings_.model.k1, 0.0))) * motion_.v;
  out.blend = blend_;
  out.eps = late_ > 0 ? product(used_, unit_phasor(in.omega * late_)) : used_;
  out.level = std::sqrt(square_);
  out.adapt = steps_ == 0 && !limit && !lost && !check_.let_go();
  out.trip = steps_ >= kTripStep;
  out.word = reasons_ | (limit ? kSaturation : 0U) | (lost ? kSensorLost : 0U);
  out.word |=
      (out.adapt ? 0U : kAdaptationFrozen) | (follow_ || (settings_.carried && steps_ > 0) ? kFeedforwardReplaced : 0U);
  out.word |= (steps_ == 2 || steps_ == 3 ? kGainLowered : 0U) | (steps_ >= 4 || lost ? kFeedbackOff : 0U);
  out.word |= (steps_ >= kForceStep ? kForceOff : 0U) | (out.trip ? kSupervisionTrip : 0U);
  return out;
}

}  // namespace whirl::control
