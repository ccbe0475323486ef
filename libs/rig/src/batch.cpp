#include "whirl/rig/batch.hpp"

#include <algorithm>
#include <cmath>

#include "alive.hpp"
#include "lane_sheets.hpp"
#include "normal.hpp"
#include "tables.hpp"
#include "vector_registers.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rig/sensor_response.hpp"

namespace whirl::rig {

namespace {

constexpr std::size_t kHistory = 64;  // ticks of commands and readings kept

}  // namespace

template <int Lanes>
struct BatchRig<Lanes>::State {
  struct Mode {
    Lane x, dx, y, dy;
  };
  template <class T>
  struct Map {
    T q_q, q_dq, q_f, q_c, dq_q, dq_dq, dq_f, dq_c;
  };
  struct Pair {
    Lane x, y;
  };

  std::shared_ptr<const RigTables> tables;                  // of lane 0: all that the lanes share
  std::array<std::shared_ptr<const RigTables>, Lanes> own;  // of every lane
  bool one_plant = true;                                    // and one noise
  std::vector<Normal> normals;                              // one, or one per lane
  rotor::LateralCoefficients<Lane> coefficients;
  rotor::FurtherForces<Lane> forces{};
  bool further = false, dry = false;  // of any lane
  Lane eps_re, eps_im, actuator_gain, axis_cos, axis_sin;
  long ticks_done = 0, steps = 0, captured = 0;
  Lane x, y, vx, vy;            // rotor
  Lane target_x, target_y;      // force the actuators tend to, N
  Lane slewed_x, slewed_y;      // what the amplifiers follow, N
  Lane played_x, played_y;      // after hysteresis, N
  Lane distance_x, distance_y;  // force minus target, N
  Lane force0_x, force0_y;      // force at the last tick, N
  std::vector<Mode> modes;
  /// What the sensor sees of a mode: linear in the force, its participation relative to lane 0 may stand here.
  std::vector<Lane> seen = std::vector<Lane>(modes.size());
  /// As RigTables::mode_maps, where the lanes differ in modes' frequencies or actuators' lag; empty: those of lane 0.
  std::vector<std::vector<Map<Lane>>> lane_maps;
  std::array<Pair, kHistory> commands{};
  std::array<Pair, kHistory> readings{};
  LaneSheets<Lanes> sheets;
  SensorMemory<Lane> sensor_x, sensor_y;
  long read_at = 0;  // step of the last reading
  Reading reading;

  State(const std::array<std::shared_ptr<const RigTables>, Lanes>& t, const std::array<std::uint64_t, Lanes>& seeds,
        bool one)
      : tables(t[0]), own(t), one_plant(one), modes(tables->parameters.modes.size()), sheets(t) {
    for (int lane = 0; lane < Lanes; ++lane) {
      const RigTables& r = *own[static_cast<std::size_t>(lane)];
      if (r.parameters.tilt.active()) throw Error("batch of rigs: a rotor that tilts runs one rig at a time only");
      if (r.angle != tables->angle || r.gain != tables->gain || r.mode_maps.size() != tables->mode_maps.size()) {
        throw Error("batch of rigs: the lanes differ in profile, timing, encoder, laser rate or mass");
      }
      const rotor::LateralCoefficients<double>& c = r.coefficients;
      coefficients.kx[lane] = c.kx, coefficients.ky[lane] = c.ky, coefficients.kxy[lane] = c.kxy;
      coefficients.k2[lane] = c.k2;
      coefficients.cx[lane] = c.cx, coefficients.cy[lane] = c.cy, coefficients.cxy[lane] = c.cxy;
      further = further || r.further, dry = dry || r.dry;
      rotor::each_force(forces, r.forces, [&](Lane& all, double force) { all[lane] = force; });
      eps_re[lane] = r.eps_re, eps_im[lane] = r.eps_im;
      const RigActuator& a = r.parameters.actuator;
      actuator_gain[lane] = 1 + a.gain_error;
      axis_cos[lane] = std::cos(a.axis_rotation), axis_sin[lane] = std::sin(a.axis_rotation);
    }
    own_maps();
    for (std::size_t i = 0; i < modes.size(); ++i) {
      for (int lane = 0; lane < Lanes; ++lane) {
        const RigMode &own_mode = own[static_cast<std::size_t>(lane)]->parameters.modes[i],
                      &first = tables->parameters.modes[i];
        const bool alike = lane_maps.empty() && first.participation != 0;
        const double share = alike ? own_mode.participation / first.participation : 1;
        seen[i][lane] = own_mode.sensor_sign * share;
      }
    }
    restart(seeds);
  }

  void own_maps() {
    const auto differs = [&](std::size_t i) {
      return std::ranges::any_of(own, [&](const auto& r) {
        return r->parameters.modes[i].frequency != tables->parameters.modes[i].frequency ||
               r->lag_half_step != tables->lag_half_step;
      });
    };
    bool any = false;
    for (std::size_t i = 0; i < modes.size(); ++i) any = any || differs(i);
    if (!any) return;
    for (std::size_t sub = 0; sub < tables->mode_maps.size(); ++sub) {
      std::vector<Map<Lane>>& maps = lane_maps.emplace_back(modes.size());
      for (std::size_t i = 0; i < modes.size(); ++i) {
        for (int lane = 0; lane < Lanes; ++lane) {
          const ModeMap& m = own[static_cast<std::size_t>(lane)]->mode_maps[sub][i];
          Map<Lane>& to = maps[i];
          to.q_q[lane] = m.q_q, to.q_dq[lane] = m.q_dq, to.q_f[lane] = m.q_f, to.q_c[lane] = m.q_c;
          to.dq_q[lane] = m.dq_q, to.dq_dq[lane] = m.dq_dq, to.dq_f[lane] = m.dq_f, to.dq_c[lane] = m.dq_c;
        }
      }
    }
  }
  Map<Vector> map_of(std::size_t sub, std::size_t i, int lane) const noexcept {
    if (lane_maps.empty()) {
      const ModeMap& m = tables->mode_maps[sub][i];
      const auto all = [](double value) { return Vector{} + value; };
      return {all(m.q_q), all(m.q_dq), all(m.q_f), all(m.q_c), all(m.dq_q), all(m.dq_dq), all(m.dq_f), all(m.dq_c)};
    }
    const Map<Lane>& m = lane_maps[sub][i];
    const auto of = [lane](const Lane& l) { return load(&l.v[0] + lane); };
    return {of(m.q_q), of(m.q_dq), of(m.q_f), of(m.q_c), of(m.dq_q), of(m.dq_dq), of(m.dq_f), of(m.dq_c)};
  }

  static constexpr std::size_t slot(long tick) { return static_cast<std::size_t>(tick) % kHistory; }

  void restart(const std::array<std::uint64_t, Lanes>& seeds) {
    normals.clear();
    for (std::uint64_t seed : seeds) {
      normals.emplace_back(seed);
      if (one_plant) break;
    }
    ticks_done = steps = captured = 0;
    for (int lane = 0; lane < Lanes; ++lane) {
      const rotor::LateralState<double>& s = own[static_cast<std::size_t>(lane)]->start.disk;
      x[lane] = s.x, y[lane] = s.y, vx[lane] = s.vx, vy[lane] = s.vy;
    }
    slewed_x = slewed_y = played_x = played_y = {};
    target_x = target_y = distance_x = distance_y = force0_x = force0_y = {};
    for (std::size_t i = 0; i < modes.size(); ++i) {
      modes[i] = {};
      for (int lane = 0; lane < Lanes; ++lane) {
        // What stands in the lanes is seen with the lane's share of the participation, which the deflection has not.
        const double share = std::abs(seen[i][lane]);
        const double initial = own[static_cast<std::size_t>(lane)]->parameters.modes[i].initial;
        modes[i].x[lane] = share > 0 ? initial / share : initial;
      }
      modes[i].y = modes[i].x;
    }
    commands.fill({});
    capture(0);
    measure();
  }

  // Displacement by the modes `sub` steps after the last tick, added to x and y of one vector of lanes.
  void add_modes(int lane, int sub, Vector& sx, Vector& sy) const noexcept {
    const Vector fx = load(&force0_x.v[0] + lane), fy = load(&force0_y.v[0] + lane);
    for (std::size_t i = 0; i < modes.size(); ++i) {
      const Vector sign = load(&seen[i].v[0] + lane);
      const Vector qx = load(&modes[i].x.v[0] + lane), qy = load(&modes[i].y.v[0] + lane);
      if (sub == 0) {
        sx += sign * qx;
        sy += sign * qy;
        continue;
      }
      const Map<Vector> m = map_of(static_cast<std::size_t>(sub - 1), i, lane);
      const Vector tx = load(&target_x.v[0] + lane), ty = load(&target_y.v[0] + lane);
      sx += sign * (m.q_q * qx + m.q_dq * load(&modes[i].dx.v[0] + lane) + m.q_f * fx + m.q_c * tx);
      sy += sign * (m.q_q * qy + m.q_dq * load(&modes[i].dy.v[0] + lane) + m.q_f * fy + m.q_c * ty);
    }
  }

  void propagate_modes(int lane) noexcept {
    const Vector fx = load(&force0_x.v[0] + lane), fy = load(&force0_y.v[0] + lane);
    const Vector tx = load(&target_x.v[0] + lane), ty = load(&target_y.v[0] + lane);
    for (std::size_t i = 0; i < modes.size(); ++i) {
      const Map<Vector> m = map_of(tables->mode_maps.size() - 1, i, lane);
      Mode& s = modes[i];
      const Vector qx = load(&s.x.v[0] + lane), dx = load(&s.dx.v[0] + lane);
      const Vector qy = load(&s.y.v[0] + lane), dy = load(&s.dy.v[0] + lane);
      store(&s.x.v[0] + lane, m.q_q * qx + m.q_dq * dx + m.q_f * fx + m.q_c * tx);
      store(&s.dx.v[0] + lane, m.dq_q * qx + m.dq_dq * dx + m.dq_f * fx + m.dq_c * tx);
      store(&s.y.v[0] + lane, m.q_q * qy + m.q_dq * dy + m.q_f * fy + m.q_c * ty);
      store(&s.dy.v[0] + lane, m.dq_q * qy + m.dq_dq * dy + m.dq_f * fy + m.dq_c * ty);
    }
  }

  // Readings of all ticks whose sensor instant is now, `sub` steps after the last tick.
  void capture(int sub) noexcept {
    const RigTables& t = *tables;
    const RigLaser& laser = t.parameters.laser;
    const bool responds = sheets.responds, first_reading = captured == 0;
    if (responds) sheets.span(t.angle->step * static_cast<double>(steps - read_at));
    const auto noise_of = [&](int lane) -> rotor::LateralInput<double> {
      Normal& normal = normals[static_cast<std::size_t>(lane)];
      const double nx = laser.noise * normal(), ny = laser.noise * normal();
      return {nx, ny};
    };
    const auto fill = [&](Pair& pair, const auto& of_lane) {
      if (one_plant) {
        const rotor::LateralInput<double> same = of_lane(0);
        pair.x.v.fill(same.x), pair.y.v.fill(same.y);
        return;
      }
      for (int lane = 0; lane < Lanes; ++lane) {
        const rotor::LateralInput<double> a = of_lane(lane);
        pair.x[lane] = a.x, pair.y[lane] = a.y;
      }
    };
    // Runout, modes driven by the unbalance; noise, unless the response of the sensor comes between them.
    Pair added, noise{};
    const bool noisy = laser.noise > 0;
    fill(added, [&](int lane) -> rotor::LateralInput<double> {
      const rotor::LateralInput<double> surface =
          own[static_cast<std::size_t>(lane)]->not_disk[static_cast<std::size_t>(captured)];
      if (!noisy || responds) return surface;
      const rotor::LateralInput<double> n = noise_of(lane);
      return {surface.x + n.x, surface.y + n.y};
    });
    if (noisy && responds) fill(noise, noise_of);
    Pair& out = readings[slot(captured)];
    for (int lane = 0; lane < Lanes; lane += kWidth) {
      Vector sx = load(&x.v[0] + lane), sy = load(&y.v[0] + lane);
      add_modes(lane, sub, sx, sy);
      sx += load(&added.x.v[0] + lane), sy += load(&added.y.v[0] + lane);
      if (responds) {
        sx = sheets.read(lane, sensor_x, sx, first_reading) + load(&noise.x.v[0] + lane);
        sy = sheets.read(lane, sensor_y, sy, first_reading) + load(&noise.y.v[0] + lane);
      }
      sx = clamped(sx, 0.5 * laser.range);
      sy = clamped(sy, 0.5 * laser.range);
      store(&out.x.v[0] + lane, t.sensor_lsb > 0 ? quantised(sx, t.sensor_lsb) : sx);
      store(&out.y.v[0] + lane, t.sensor_lsb > 0 ? quantised(sy, t.sensor_lsb) : sy);
    }
    read_at = steps;
    const std::size_t first = slot(captured++);
    while (captured <= t.angle->ticks && t.angle->sensor_step[static_cast<std::size_t>(captured)] == steps) {
      readings[slot(captured++)] = readings[first];
    }
  }

  void measure() noexcept {
    const rotor::AngleState& a = tables->angle->measured_angle[static_cast<std::size_t>(ticks_done)];
    const Pair& r = readings[slot(ticks_done)];
    reading = {static_cast<double>(ticks_done) / tables->parameters.timing.rate, r.x, r.y, a.beta, a.omega, a.alpha};
  }

  void update_target() noexcept {
    const RigTables& t = *tables;
    const RigActuator& a = t.parameters.actuator;
    const long delay = a.delay_samples + a.extra_delay_samples;
    const Pair none{};
    const Pair& c = ticks_done >= delay ? commands[slot(ticks_done - delay)] : none;
    const double per_newton = 1 / a.force_per_volt;
    for (int lane = 0; lane < Lanes; lane += kWidth) {
      const auto force = [&](const Lane& command) {
        Vector volts = load(&command.v[0] + lane) * per_newton;
        volts = volts == volts ? volts : Vector{};  // NaN: no force
        volts = clamped(volts, a.voltage_limit);
        return (t.volt_lsb > 0 ? quantised(volts, t.volt_lsb) : volts) * a.force_per_volt;
      };
      const Vector u = sheets.delivered(lane, force(c.x), slewed_x, played_x),
                   v = sheets.delivered(lane, force(c.y), slewed_y, played_y);
      const Vector fx = load(&target_x.v[0] + lane) + load(&distance_x.v[0] + lane);
      const Vector fy = load(&target_y.v[0] + lane) + load(&distance_y.v[0] + lane);
      const Vector gain = load(&actuator_gain.v[0] + lane);
      const Vector cos = load(&axis_cos.v[0] + lane), sin = load(&axis_sin.v[0] + lane);
      const Vector tx = gain * (cos * u - sin * v), ty = gain * (sin * u + cos * v);
      const bool lag = t.lag_half_step > 0;
      store(&force0_x.v[0] + lane, fx);
      store(&force0_y.v[0] + lane, fy);
      store(&target_x.v[0] + lane, tx);
      store(&target_y.v[0] + lane, ty);
      store(&distance_x.v[0] + lane, lag ? alive(fx - tx) : Vector{});
      store(&distance_y.v[0] + lane, lag ? alive(fy - ty) : Vector{});
    }
  }

  using Input = rotor::LateralInput<Vector>;
  rotor::LateralState<Vector> further_step(int lane, const rotor::LateralCoefficients<Vector>& a,
                                           const rotor::LateralState<Vector>& s, const Input& in0, const Input& in_mid,
                                           const Input& in1) const noexcept {
    const AngleTables& angle = *tables->angle;
    rotor::FurtherForces<Vector> here;
    rotor::each_force(here, forces, [&](Vector& v, const Lane& all) { v = load(&all.v[0] + lane); });
    return rotor::lateral_step(a, here, dry, &angle.omega[static_cast<std::size_t>(2 * steps)],
                               angle.step * static_cast<double>(steps), s, in0, in_mid, in1, angle.step);
  }

  // One Runge-Kutta step of all lanes; f points at the forcing of its start.
  void step(const rotor::LateralInput<double>* f) noexcept {
    const RigTables& t = *tables;
    const double g = t.gain;
    const rotor::LateralCoefficients<Lane>& c = coefficients;
    for (int lane = 0; lane < Lanes; lane += kWidth) {
      const auto of = [lane](const Lane& l) { return load(&l.v[0] + lane); };
      const rotor::LateralCoefficients<Vector> a{of(c.kx), of(c.ky), of(c.kxy), of(c.k2),
                                                 of(c.cx), of(c.cy), of(c.cxy)};
      const Vector er = of(eps_re), ei = of(eps_im), r = of(sheets.lag_half_step);
      Vector dx = load(&distance_x.v[0] + lane), dy = load(&distance_y.v[0] + lane);
      const Vector tx = g * load(&target_x.v[0] + lane), ty = g * load(&target_y.v[0] + lane);
      const auto input = [&](const rotor::LateralInput<double>& unbalance) {
        return rotor::LateralInput<Vector>{er * unbalance.x - ei * unbalance.y + tx + g * dx,
                                           er * unbalance.y + ei * unbalance.x + ty + g * dy};
      };
      const rotor::LateralInput<Vector> in0 = input(f[0]);
      dx *= r, dy *= r;
      const rotor::LateralInput<Vector> in_mid = input(f[1]);
      dx *= r, dy *= r;
      const rotor::LateralInput<Vector> in1 = input(f[2]);
      const rotor::LateralState<Vector> s{load(&x.v[0] + lane), load(&y.v[0] + lane), load(&vx.v[0] + lane),
                                          load(&vy.v[0] + lane)};
      const rotor::LateralState<Vector> next = further ? further_step(lane, a, s, in0, in_mid, in1)
                                                       : rotor::lateral_step(a, s, in0, in_mid, in1, t.angle->step);
      store(&x.v[0] + lane, next.x);
      store(&y.v[0] + lane, next.y);
      store(&vx.v[0] + lane, next.vx);
      store(&vy.v[0] + lane, next.vy);
      store(&distance_x.v[0] + lane, dx);
      store(&distance_y.v[0] + lane, dy);
    }
  }

  // One tick of a rotor that nothing holds and nobody reads: the structure answers the force alone.
  void coast() noexcept {
    const RigTables& t = *tables;
    if (ticks_done >= t.angle->ticks) return;
    const rotor::LateralInput<double>* f = &t.angle->forcing[static_cast<std::size_t>(2 * steps)];
    for (int i = 0; i < t.parameters.timing.substeps; ++i, f += 2, ++steps) step(f);
    ++ticks_done;
  }

  void advance() noexcept {
    const RigTables& t = *tables;
    if (ticks_done >= t.angle->ticks) return;
    update_target();
    const int n = t.parameters.timing.substeps;
    const rotor::LateralInput<double>* f = &t.angle->forcing[static_cast<std::size_t>(2 * steps)];
    for (int i = 1; i <= n; ++i, f += 2) {
      step(f);
      ++steps;
      if (captured <= t.angle->ticks && t.angle->sensor_step[static_cast<std::size_t>(captured)] == steps) capture(i);
    }
    for (int lane = 0; lane < Lanes; lane += kWidth) propagate_modes(lane);
    ++ticks_done;
    commands[slot(ticks_done)] = commands[slot(ticks_done - 1)];
    measure();
  }
};

template <int Lanes>
BatchRig<Lanes>::BatchRig(std::shared_ptr<const RigTables> tables, std::uint64_t seed)
    : state_([&] {
        std::array<std::shared_ptr<const RigTables>, Lanes> same;
        std::array<std::uint64_t, Lanes> seeds;
        same.fill(std::move(tables));
        seeds.fill(seed);
        return std::make_unique<State>(same, seeds, true);
      }()) {}
template <int Lanes>
BatchRig<Lanes>::BatchRig(const std::array<std::shared_ptr<const RigTables>, Lanes>& tables,
                          const std::array<std::uint64_t, Lanes>& seeds)
    : state_(std::make_unique<State>(tables, seeds, false)) {}
template <int Lanes>
BatchRig<Lanes>::BatchRig(BatchRig&&) noexcept = default;
template <int Lanes>
BatchRig<Lanes>& BatchRig<Lanes>::operator=(BatchRig&&) noexcept = default;
template <int Lanes>
BatchRig<Lanes>::~BatchRig() = default;
template <int Lanes>
const typename BatchRig<Lanes>::Reading& BatchRig<Lanes>::read() const noexcept {
  return state_->reading;
}
template <int Lanes>
void BatchRig<Lanes>::write(const Lane& ux, const Lane& uy) noexcept {
  state_->commands[State::slot(state_->ticks_done)] = {ux, uy};
}
template <int Lanes>
void BatchRig<Lanes>::advance() noexcept {
  state_->advance();
}
template <int Lanes>
void BatchRig<Lanes>::coast() noexcept {
  state_->coast();
}
template <int Lanes>
bool BatchRig<Lanes>::done() const noexcept {
  return state_->ticks_done >= state_->tables->angle->ticks;
}
template <int Lanes>
long BatchRig<Lanes>::tick() const noexcept {
  return state_->ticks_done;
}
template <int Lanes>
const typename BatchRig<Lanes>::Lane& BatchRig<Lanes>::true_x() const noexcept {
  return state_->x;
}
template <int Lanes>
const typename BatchRig<Lanes>::Lane& BatchRig<Lanes>::true_y() const noexcept {
  return state_->y;
}
template <int Lanes>
const typename BatchRig<Lanes>::Lane& BatchRig<Lanes>::commanded_x() const noexcept {
  return state_->played_x;
}
template <int Lanes>
void BatchRig<Lanes>::restart(std::uint64_t seed) {
  std::array<std::uint64_t, Lanes> seeds;
  for (std::size_t i = 0; i < Lanes; ++i) seeds[i] = seed + i;
  state_->restart(seeds);
}

template class BatchRig<8>;
template class BatchRig<16>;
template class BatchRig<32>;

}  // namespace whirl::rig
