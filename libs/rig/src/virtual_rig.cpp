#include "whirl/rig/virtual_rig.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "alive.hpp"
#include "normal.hpp"
#include "tables.hpp"
#include "whirl/rig/sensor_response.hpp"

namespace whirl::rig {

namespace {

constexpr std::size_t kRigHistory = 128;  // ticks of commands and readings kept; delays are below half of it

struct ModeState {
  double x = 0, dx = 0, y = 0, dy = 0;
};

}  // namespace

struct VirtualRig::State {
  std::shared_ptr<const RigTables> tables;
  RigRun run;
  Normal normal;

  long tick = 0;
  long steps = 0;     // Runge-Kutta steps done
  long captured = 0;  // ticks whose sensor reading is already taken
  rotor::LateralState<double> rotor{}, tilt{};
  rotor::LateralInput<double> force{};    // acting now, N
  rotor::LateralInput<double> target{};   // force it tends to
  rotor::LateralInput<double> applied{};  // after converter and limit, in sensor axes, nominal gain
  rotor::LateralInput<double> slewed{};   // what the amplifier follows, N
  std::vector<ModeState> modes;
  std::array<rotor::LateralInput<double>, kRigHistory> commands{};
  rt::SynchronousRelease held{1e-3};
  long written = -1;  // tick of the last command
  struct Reading {
    double x = 0, y = 0;
    bool valid = true;
  };
  std::array<Reading, kRigHistory> readings{};
  Measurement measurement;
  SensorMemory<double> sensor_x, sensor_y;
  long read_at = 0;  // step of the last reading

  State(std::shared_ptr<const RigTables> t, const RigRun& r)
      : tables(std::move(t)), run(r), normal(r.seed), modes(tables->parameters.modes.size()) {
    restart(r.seed);
  }

  void restart(std::uint64_t seed) noexcept {
    normal = Normal(seed);
    measurement = {};
    tick = steps = captured = 0;
    written = -1;
    rotor = tables->start.disk;
    tilt = tables->start.tilt;
    force = target = applied = slewed = {};
    for (std::size_t i = 0; i < modes.size(); ++i) {
      const double q = tables->parameters.modes[i].initial;
      modes[i] = {q, 0, q, 0};
    }
    commands.fill({});
    capture(modes);
    measure();
  }

  static constexpr std::size_t slot(long tick_) { return static_cast<std::size_t>(tick_) % kRigHistory; }

  // `axis` both: faults that have no axis.
  const ScriptedFault* active(RigFault kind, RigAxis axis) const noexcept {
    const double t = static_cast<double>(tick) / tables->parameters.timing.rate;
    for (const ScriptedFault& f : run.faults) {
      if (f.kind == kind && t >= f.start && t < f.end &&
          (axis == RigAxis::both || f.axis == RigAxis::both || f.axis == axis))
        return &f;
    }
    return nullptr;
  }

  // One laser with its converter; false when out of range.
  bool convert(double displacement, double& reading) noexcept {
    const double half = 0.5 * tables->parameters.laser.range;
    const bool inside = std::abs(displacement) <= half;  // false for NaN
    reading = inside ? displacement : (displacement < 0 ? -half : half);
    if (tables->sensor_lsb > 0) reading = std::nearbyint(reading / tables->sensor_lsb) * tables->sensor_lsb;
    return inside;
  }

  // Low-pass and play of the sensors, since the last instant at which they were read.
  void respond(double& x, double& y) noexcept {
    const auto clamped = [](double v, double limit) { return std::clamp(v, -limit, limit); };
    if (captured == 0) {
      sensor_x.start(x), sensor_y.start(y);
    } else {
      const SensorResponse r(tables->parameters.laser, tables->angle->step * static_cast<double>(steps - read_at));
      sensor_x.follow(r, x, clamped), sensor_y.follow(r, y, clamped);
    }
    read_at = steps;
    x = sensor_x.read, y = sensor_y.read;
  }

  // Takes the readings of all ticks whose sensor instant is now; `at` are the modes at this instant.
  void capture(const std::vector<ModeState>& at) noexcept {
    const RigTables& t = *tables;
    double x = rotor.x, y = rotor.y;
    for (std::size_t i = 0; i < at.size(); ++i) {
      x += t.parameters.modes[i].sensor_sign * at[i].x;
      y += t.parameters.modes[i].sensor_sign * at[i].y;
    }
    Reading reading;
    const rotor::LateralInput<double> added = t.not_disk[static_cast<std::size_t>(captured)];
    const double noise = t.parameters.laser.noise;
    const double nx = noise > 0 ? noise * normal() : 0, ny = noise > 0 ? noise * normal() : 0;
    x += added.x, y += added.y;
    if (has_response(t.parameters.laser)) respond(x, y);
    const bool x_valid = convert(x + nx, reading.x), y_valid = convert(y + ny, reading.y);
    reading.valid = x_valid && y_valid;
    while (captured <= t.angle->ticks && t.angle->sensor_step[static_cast<std::size_t>(captured)] == steps) {
      readings[slot(captured++)] = reading;
    }
  }

  void measure() noexcept {
    const RigParameters& p = tables->parameters;
    const Reading& r = readings[slot(tick)];
    const rotor::AngleState& a = tables->angle->measured_angle[static_cast<std::size_t>(tick)];
    const Measurement last = measurement;
    measurement = {static_cast<double>(tick) / p.timing.rate, r.x, r.y, a.beta, a.omega, a.alpha, r.valid};
    if (run.faults.empty()) return;
    if (active(RigFault::encoder_stuck, RigAxis::both)) {
      measurement.beta = last.beta;
      measurement.omega = last.omega;
      measurement.omega_dot = last.omega_dot;
    }
    if (const ScriptedFault* f = active(RigFault::encoder_slip, RigAxis::both)) measurement.beta += f->angle;
    const double full_scale = 0.5 * p.laser.range;
    if (active(RigFault::sensor_stuck, RigAxis::x)) measurement.x = last.x;
    if (active(RigFault::sensor_stuck, RigAxis::y)) measurement.y = last.y;
    if (active(RigFault::sensor_loss, RigAxis::x)) measurement.x = full_scale, measurement.valid = false;
    if (active(RigFault::sensor_loss, RigAxis::y)) measurement.y = full_scale, measurement.valid = false;
  }

  double to_volts(double command) const noexcept {
    const RigActuator& a = tables->parameters.actuator;
    double volts = command / a.force_per_volt;
    if (!(std::abs(volts) <= a.voltage_limit)) volts = std::isnan(volts) ? 0 : std::copysign(a.voltage_limit, volts);
    return tables->volt_lsb > 0 ? std::nearbyint(volts / tables->volt_lsb) * tables->volt_lsb : volts;
  }

  // What amplifier and actuator make of a force: limit of the current, slew, hysteresis about what acted last.
  double delivered(double asked, double& follows, double last) const noexcept {
    const RigActuator& a = tables->parameters.actuator;
    const double limit = a.force_limit();
    asked = asked > limit ? limit : asked < -limit ? -limit : asked;
    if (a.slew > 0) {
      const double most = a.slew / tables->parameters.timing.rate;
      asked = asked > follows + most ? follows + most : asked < follows - most ? follows - most : asked;
    }
    follows = asked;
    const double half = 0.5 * a.hysteresis;
    return half > 0 ? (last > asked + half ? asked + half : last < asked - half ? asked - half : last) : asked;
  }

  // The command that acts from this tick on, through converter, amplifier and actuator axes.
  void update_target() noexcept {
    const RigActuator& a = tables->parameters.actuator;
    long delay = a.delay_samples + a.extra_delay_samples;
    if (!run.faults.empty()) {
      if (const ScriptedFault* f = active(RigFault::extra_delay, RigAxis::both)) delay += f->delay_samples;
    }
    const rotor::LateralInput<double> command =
        tick >= delay ? commands[slot(tick - delay)] : rotor::LateralInput<double>{};
    double u = delivered(to_volts(command.x) * a.force_per_volt, slewed.x, applied.x);
    double v = delivered(to_volts(command.y) * a.force_per_volt, slewed.y, applied.y);
    if (!run.faults.empty()) {
      if (active(RigFault::actuator_loss, RigAxis::x)) u = 0;
      if (active(RigFault::actuator_loss, RigAxis::y)) v = 0;
    }
    const double c = axis_cos, s = axis_sin;
    applied = {u, v};
    target = {(1 + a.gain_error) * (c * u - s * v), (1 + a.gain_error) * (s * u + c * v)};
  }
  double axis_cos = std::cos(tables->parameters.actuator.axis_rotation);
  double axis_sin = std::sin(tables->parameters.actuator.axis_rotation);

  void propagate_modes(const rotor::LateralInput<double>& force0, int sub, const std::vector<ModeState>& from,
                       std::vector<ModeState>& to) const noexcept {
    const std::vector<ModeMap>& maps = tables->mode_maps[static_cast<std::size_t>(sub - 1)];
    for (std::size_t i = 0; i < maps.size(); ++i) {
      const ModeMap& m = maps[i];
      const ModeState s = from[i];
      to[i] = {m.q_q * s.x + m.q_dq * s.dx + m.q_f * force0.x + m.q_c * target.x,
               m.dq_q * s.x + m.dq_dq * s.dx + m.dq_f * force0.x + m.dq_c * target.x,
               m.q_q * s.y + m.q_dq * s.dy + m.q_f * force0.y + m.q_c * target.y,
               m.dq_q * s.y + m.dq_dq * s.dy + m.dq_f * force0.y + m.dq_c * target.y};
    }
  }
  std::vector<ModeState> scratch = modes;

  void advance() noexcept {
    const RigTables& t = *tables;
    if (tick >= t.angle->ticks) return;
    if (tick > written && written >= 0 && t.parameters.actuator.turns_held_force) {
      held.turn(1);
      const Command u = held.force(1);
      commands[slot(tick)] = {u.ux, u.uy};
    }
    update_target();
    const int n = t.parameters.timing.substeps;
    const rotor::LateralInput<double> force0 = force;
    // Actuator lag: distance to the target shrinks by a fixed factor per half step.
    double dx = alive(force.x - target.x), dy = alive(force.y - target.y);
    const double r = t.lag_half_step, g = t.gain;
    double er = t.eps_re, ei = t.eps_im;
    if (!run.faults.empty()) {
      if (const ScriptedFault* f = active(RigFault::unbalance, RigAxis::both)) {
        const std::complex<double> eps = f->factor * std::complex<double>(er, ei);
        er = eps.real(), ei = eps.imag();
      }
    }
    const rotor::LateralInput<double>* f = &t.angle->forcing[static_cast<std::size_t>(2 * steps)];
    const auto input = [&](const rotor::LateralInput<double>& unbalance) {
      return rotor::LateralInput<double>{er * unbalance.x - ei * unbalance.y + g * (target.x + dx),
                                         er * unbalance.y + ei * unbalance.x + g * (target.y + dy)};
    };
    if (r == 0) dx = dy = 0;
    rotor::LateralInput<double> in0 = input(f[0]);
    for (int i = 1; i <= n; ++i, f += 2) {
      dx *= r, dy *= r;
      const rotor::LateralInput<double> in_mid = input(f[1]);
      dx *= r, dy *= r;
      const rotor::LateralInput<double> in1 = input(f[2]);
      const double h = t.angle->step, time = h * static_cast<double>(steps);
      const double* omega = &t.angle->omega[static_cast<std::size_t>(2 * steps)];
      if (t.parameters.tilt.active()) {
        const rotor::TiltedState next =
            rotor::tilted_step(t.coefficients, t.forces, t.tilt, {rotor, tilt}, {in0, f[0], omega[0], time},
                               {in_mid, f[1], omega[1], time + 0.5 * h}, {in1, f[2], omega[2], time + h}, h);
        rotor = next.disk, tilt = next.tilt;
      } else if (t.further) {
        rotor = rotor::lateral_step(t.coefficients, t.forces, t.dry, omega, time, rotor, in0, in_mid, in1, h);
      } else {
        rotor = rotor::lateral_step(t.coefficients, rotor, in0, in_mid, in1, h);
      }
      in0 = in1;
      ++steps;
      if (captured <= t.angle->ticks && t.angle->sensor_step[static_cast<std::size_t>(captured)] == steps) {
        propagate_modes(force0, i, modes, scratch);
        capture(scratch);
      }
    }
    propagate_modes(force0, n, modes, modes);
    force = {target.x + dx, target.y + dy};
    ++tick;
    commands[slot(tick)] = commands[slot(tick - 1)];
    measure();
  }
};

VirtualRig::VirtualRig(const RigParameters& parameters, const RigRun& run)
    : VirtualRig(make_rig_tables(parameters), run) {}
VirtualRig::VirtualRig(std::shared_ptr<const RigTables> tables, const RigRun& run)
    : state_(std::make_unique<State>(std::move(tables), run)) {}
VirtualRig::VirtualRig(VirtualRig&&) noexcept = default;
VirtualRig& VirtualRig::operator=(VirtualRig&&) noexcept = default;
VirtualRig::~VirtualRig() = default;

Measurement VirtualRig::read() const noexcept { return state_->measurement; }
void VirtualRig::write(const Command& c) noexcept {
  state_->commands[State::slot(state_->tick)] = {c.ux, c.uy};
  if (state_->tables->parameters.actuator.turns_held_force) state_->written = -1;
}
bool VirtualRig::hold(const rt::SynchronousRelease& force) noexcept {
  if (!state_->tables->parameters.actuator.turns_held_force) return false;
  state_->held = force;
  state_->written = state_->tick;
  return true;
}
void VirtualRig::advance() noexcept { state_->advance(); }
bool VirtualRig::done() const noexcept { return state_->tick >= state_->tables->angle->ticks; }
double VirtualRig::time() const noexcept { return state_->measurement.t; }
long VirtualRig::tick() const noexcept { return state_->tick; }
long VirtualRig::ticks() const noexcept { return state_->tables->angle->ticks; }
void VirtualRig::restart(std::uint64_t seed) noexcept { state_->restart(seed); }

std::complex<double> RigTruth::z() const noexcept { return {rig_->state_->rotor.x, rig_->state_->rotor.y}; }
std::complex<double> RigTruth::dz() const noexcept { return {rig_->state_->rotor.vx, rig_->state_->rotor.vy}; }
std::complex<double> RigTruth::tilt() const noexcept { return {rig_->state_->tilt.x, rig_->state_->tilt.y}; }
std::complex<double> RigTruth::force() const noexcept { return {rig_->state_->force.x, rig_->state_->force.y}; }
std::complex<double> RigTruth::commanded() const noexcept { return {rig_->state_->applied.x, rig_->state_->applied.y}; }
rotor::AngleState RigTruth::angle() const noexcept {
  return rig_->state_->tables->angle->true_angle[static_cast<std::size_t>(rig_->state_->tick)];
}
bool RigTruth::finite() const noexcept {
  return std::isfinite(rig_->state_->rotor.x) && std::isfinite(rig_->state_->rotor.y);
}

}  // namespace whirl::rig
