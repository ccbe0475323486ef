#include "whirl/control/controller.hpp"

#include <algorithm>
#include <cmath>

namespace whirl::control {
namespace {

/// What supervision leaves of an acceleration that the law asks for.
double taken_back(const Supervision& s, double asked, double forward, double own) noexcept {
  return s.force * ((1 - s.own) * (forward + s.gain * (asked - forward)) + s.own * own);
}

}  // namespace

Controller::Controller(const ControllerSettings& settings, const AnyEstimator& estimator, const AnyLaw& law,
                       const SampleGate& gate, const Runout& runout, const Supervisor& supervisor,
                       const std::array<StructureMode, Structure::kModes>& modes,
                       const Reidentifier& reidentifier) noexcept
    : settings_(settings),
      estimator_(estimator),
      law_(law),
      gate_(gate),
      runout_(runout),
      supervisor_(supervisor),
      reidentifier_(reidentifier),
      has_runout_(!runout.empty()) {
  const double samples = settings.timing.delay / settings.timing.step;
  whole_delay_ = static_cast<int>(std::floor(samples + 1e-9));
  fraction_ = std::max(0.0, samples - whole_delay_);
  if (fraction_ < 1e-9) fraction_ = 0;
  structure_ = Structure(modes, settings.timing.step, fraction_);
}

void Controller::reset() noexcept {
  std::visit([](auto& e) { e.reset(); }, estimator_);
  std::visit(
      [](auto& l) {
        l.x.reset(), l.y.reset();
        if constexpr (requires { l.synchronous; }) l.synchronous.reset();
        if constexpr (requires { l.linear; }) l.linear.reset();
      },
      law_);
  gate_.reset();
  supervisor_.reset();
  reidentifier_.reset();
  structure_.reset();
  history_.fill({});
  sent_.fill({});
  correction_ = {};
  head_ = 0;
  time_ = 0;
  state_ = {};
}

std::complex<double> Controller::past(int samples) const noexcept {
  const int size = static_cast<int>(history_.size());
  return history_[static_cast<std::size_t>((head_ - samples + size) % size)];
}

std::complex<double> Controller::sent(int samples) const noexcept {
  const int size = static_cast<int>(sent_.size());
  return sent_[static_cast<std::size_t>((head_ - samples + size) % size)];
}

/// What the design's machine would have got.
std::complex<double> Controller::seen(std::complex<double> sent) const noexcept {
  if (settings_.reidentify != Reidentify::acts) return sent;
  return (1 + state_.reidentification.acting[2]) * sent - correction_;
}

void Controller::push(std::complex<double> sent) noexcept {
  history_[static_cast<std::size_t>(head_)] = seen(sent);
  sent_[static_cast<std::size_t>(head_)] = sent;
  head_ = (head_ + 1) % static_cast<int>(history_.size());
}

void Controller::applied(const Command& command) noexcept {
  const int size = static_cast<int>(history_.size());
  const auto last = static_cast<std::size_t>((head_ - 1 + size) % size);
  state_.applied = {command.ux, command.uy};
  sent_[last] = settings_.gain * state_.applied;
  history_[last] = seen(sent_[last]);
}

DiskMotion Controller::at_effect(const DiskMotion& now, double omega, const SampleTurns& turns) const noexcept {
  const double h = settings_.timing.step;
  if (!settings_.predict) {
    DiskMotion s = now;
    s.d = product(now.d, unit_phasor(omega * (settings_.feedforward.advance ? settings_.timing.delay + 0.5 * h
                                                                            : settings_.timing.sensor)));
    return s;
  }
  MotionPrediction p(settings_.model, now);
  if (fraction_ > 0) p.step(past(whole_delay_ + 1), turns.first, fraction_ * h);
  for (int i = whole_delay_; i >= 1; --i) p.step(past(i), turns.half, h);
  // The force of this very step is not known yet: over half the hold the last one stands for it, turned with
  // the rotor because most of it is synchronous.
  p.step(product(past(1), product(turns.half, turns.half)), turns.quarter, 0.5 * h);
  return p.motion();
}

/// What amplifier and actuator can do, so that the history is the force that acts.
void Controller::limit_force() noexcept {
  state_.applied = state_.requested;
  state_.saturated = false;
  if (const double limit = settings_.force.largest; limit > 0) {
    state_.applied = {std::clamp(state_.applied.real(), -limit, limit),
                      std::clamp(state_.applied.imag(), -limit, limit)};
    // A law that knows the limit asks for it up to rounding.
    const double reached = (1 - 1e-12) * limit;
    state_.saturated = std::abs(state_.applied.real()) >= reached || std::abs(state_.applied.imag()) >= reached;
  }
  if (settings_.force.slew > 0) {
    const double most = settings_.force.slew * settings_.timing.step;
    const std::complex<double> last = sent(1) / settings_.gain, asked = state_.applied;
    state_.applied = {std::clamp(asked.real(), last.real() - most, last.real() + most),
                      std::clamp(asked.imag(), last.imag() - most, last.imag() + most)};
    state_.saturated = state_.saturated || state_.applied != asked;
  }
}

void Controller::watch(const EstimatorInput& in, std::complex<double> turn) noexcept {
  SupervisorInput w;
  w.z = in.z;
  w.fresh = in.fresh;
  w.saturated = state_.saturated;
  w.a = in.split * in.a_first + (1 - in.split) * in.a_second;
  w.forcing = in.forcing;
  w.turn = turn;
  const Supervision& last = state_.supervision;
  w.d = (1 - last.blend) * state_.estimate.d + last.blend * product(last.eps, in.forcing);
  w.omega = in.omega;
  w.half = in.turns->half;
  w.held = gate_.held;
  w.gap = gap_;
  state_.supervision = supervisor_.step(w);
}

void Controller::reidentify(const EstimatorInput& in, std::complex<double> turn, double omega_dot) noexcept {
  if (settings_.reidentify == Reidentify::off) return;
  const std::uint32_t word = state_.supervision.word;
  ReidentifierInput r;
  r.z = in.z;
  r.a = in.split * sent(whole_delay_ + 2) + (1 - in.split) * sent(whole_delay_ + 1);
  r.forcing = in.forcing;
  r.turn = turn;
  r.half = in.turns->half;
  r.omega = in.omega, r.omega_dot = omega_dot;
  r.frozen = !in.fresh || gap_ || state_.saturated || (word & kAdaptationFrozen) != 0;
  r.taken = (word & (kGainLowered | kForceOff)) != 0 || (word & (kFeedbackOff | kSensorLost)) == kFeedbackOff;
  state_.reidentification = reidentifier_.step(r);
}

/// What to ask the machine for so that it moves as the design's would. A law that does not predict gets the motion of
/// the time of effect from the velocity: a late stiffness is a negative damping.
std::complex<double> Controller::corrected(std::complex<double> asked) noexcept {
  if (settings_.reidentify != Reidentify::acts) return asked;
  const MachineShares& acting = state_.reidentification.acting;
  const double ahead = settings_.predict ? 0 : settings_.timing.delay + 0.5 * settings_.timing.step;
  const DiskMotion& e = state_.effect;
  const double left = state_.supervision.gain * state_.supervision.force;
  correction_ =
      (left * acting[0] * settings_.model.k1) * (e.z + ahead * e.v) + (left * acting[1] * settings_.model.c) * e.v;
  return (1 / (1 + acting[2])) * (asked + correction_);
}

Expected<Command, Fault> Controller::step(const Measurement& m) noexcept {
  const auto fault = [this](Fault reason) {
    state_.requested = state_.applied = correction_ = {};
    push({});
    return Expected<Command, Fault>::fault(reason);
  };
  if (!std::isfinite(m.beta) || !std::isfinite(m.omega) || !std::isfinite(m.omega_dot)) return fault(Fault::not_finite);

  gap_ = m.t - time_ > 1.5 * settings_.timing.step, time_ = m.t;
  const bool fresh = gate_.accept(m);
  state_.held = !fresh;
  state_.held_total = gate_.held_total;
  if (gate_.held > settings_.stale_limit) return fault(Fault::stale_sensor);

  // Rotor quantities at the instant the displacement was taken.
  const double beta = m.beta - m.omega * settings_.timing.sensor;
  const std::complex<double> turn = unit_phasor(beta);
  EstimatorInput in;
  in.z = gate_.good - settings_.offset;
  if (has_runout_) in.z -= runout_.at(turn);
  in.fresh = fresh;
  in.a_first = past(whole_delay_ + 2), in.a_second = past(whole_delay_ + 1);
  in.split = fraction_;
  if (!structure_.empty()) in.z -= structure_.step(in.a_first, in.a_second);
  in.forcing = unbalance_per_metre(turn, m.omega, m.omega_dot);
  const Supervision& watched = state_.supervision;
  const std::complex<double> eps = settings_.eps + watched.blend * (watched.eps - settings_.eps);
  const Feedforward& forwarded = settings_.feedforward;
  in.d = forwarded.on ? product(eps, in.forcing) : std::complex<double>{};
  in.omega = m.omega;
  in.turns.emplace(m.omega, fraction_, settings_.timing.step);
  state_.measured = in.z;
  state_.estimate = std::visit([&](auto& e) noexcept { return e.step(in); }, estimator_);
  if (settings_.supervise) {
    watch(in, turn);
    reidentify(in, turn, m.omega_dot);
    if (watched.trip) return fault(kSupervision);
  }
  DiskMotion now = state_.estimate;
  if (watched.blend > 0) now.d += watched.blend * (product(watched.eps, in.forcing) - now.d);
  state_.effect = at_effect(now, m.omega, *in.turns);
  const DiskMotion& e = state_.effect;
  const std::complex<double> d = (forwarded.on ? 1 : forwarded.carried ? watched.blend : 0) * e.d;
  const std::complex<double> f = settings_.model.acceleration(e.z, e.v, settings_.cancel) + d;
  // The synchronous part of the force, which is not feedback.
  std::complex<double> forward = -d;
  auto [ax, ay] = std::visit(
      [&](auto& l) noexcept {
        AxisOutput x = l.x.step({e.z.real(), e.v.real(), f.real(), d.real(), -d.imag(), m.omega});
        AxisOutput y = l.y.step({e.z.imag(), e.v.imag(), f.imag(), d.imag(), d.real(), m.omega});
        if constexpr (requires { l.synchronous; }) {
          const double ahead = m.omega * (settings_.timing.delay + 0.5 * settings_.timing.step);
          const std::complex<double> a =
              l.synchronous.step(in.z, beta, m.omega, product(in.forcing, unit_phasor(ahead)),
                                 fresh && !state_.saturated && watched.adapt);
          x.a += a.real();
          y.a += a.imag();
          forward += a;
        }
        if constexpr (requires { l.linear; }) {
          const std::complex<double> a = l.linear.step(e.z, e.v, m.omega);
          x.a += a.real();
          y.a += a.imag();
        }
        return std::pair{x, y};
      },
      law_);
  if (watched.gain < 1 || watched.force < 1 || watched.own > 0) {
    ax.a = taken_back(watched, ax.a, forward.real(), watched.damper.real() - e.d.real());
    ay.a = taken_back(watched, ay.a, forward.imag(), watched.damper.imag() - e.d.imag());
  }
  state_.s = {ax.s, ay.s};
  state_.requested = corrected({ax.a, ay.a}) / settings_.gain;
  if (!std::isfinite(state_.requested.real()) || !std::isfinite(state_.requested.imag()))
    return fault(Fault::not_finite);

  limit_force();
  push(settings_.gain * state_.applied);
  return Command{state_.applied.real(), state_.applied.imag()};
}

}  // namespace whirl::control
