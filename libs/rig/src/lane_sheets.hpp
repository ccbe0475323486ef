#pragma once
#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include "tables.hpp"
#include "vector_registers.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rig/batch.hpp"
#include "whirl/rig/sensor_response.hpp"

namespace whirl::rig {

/// The data sheets of rigs side by side: response of the sensors, limits, play and lag of the actuators. A number that
/// one of them does not state has no effect in its lane.
template <int Lanes>
class LaneSheets {
 public:
  using Lane = LaneArray<Lanes>;
  using Tables = std::array<std::shared_ptr<const RigTables>, Lanes>;

  /// Throws Error where some lanes have an actuator with lag and others have none.
  explicit LaneSheets(const Tables& own) : own_(own) {
    for (int lane = 0; lane < Lanes; ++lane) {
      const RigTables& t = *own[static_cast<std::size_t>(lane)];
      const RigActuator& a = t.parameters.actuator;
      force_limit[lane] = a.force_limit();
      most_change_[lane] = a.slew > 0 ? a.slew / t.parameters.timing.rate : std::numeric_limits<double>::infinity();
      half_play_[lane] = 0.5 * a.hysteresis;
      lag_half_step[lane] = t.lag_half_step;
      slews_ = slews_ || a.slew > 0;
      plays_ = plays_ || a.hysteresis > 0;
      responds = responds || has_response(t.parameters.laser);
      if ((t.lag_half_step > 0) != (own[0]->lag_half_step > 0)) {
        throw Error("batch of rigs: some lanes have actuators with a bandwidth and others have none");
      }
    }
  }

  bool responds = false;  ///< any sensor
  Lane force_limit;       ///< N
  Lane lag_half_step;     ///< as RigTables

  /// What amplifier and actuator make of a force: limit, slew, hysteresis about what acted last.
  Vector delivered(int lane, Vector asked, Lane& follows, Lane& last) const noexcept {
    const auto of = [lane](const Lane& l) { return load(&l.v[0] + lane); };
    asked = clamped(asked, of(force_limit));
    const Vector before = of(follows);
    if (slews_) asked = before + clamped(asked - before, of(most_change_));
    store(&follows.v[0] + lane, asked);
    if (plays_) asked += clamped(of(last) - asked, of(half_play_));
    store(&last.v[0] + lane, asked);
    return asked;
  }

  /// The sensors' answer will be asked for over `time`, s.
  void span(double time) noexcept {
    if (time == time_) return;
    time_ = time;
    for (int lane = 0; lane < Lanes; ++lane) {
      const SensorResponse r(own_[static_cast<std::size_t>(lane)]->parameters.laser, time);
      keep_[lane] = r.keep, before_[lane] = r.before, now_[lane] = r.now, half_sensor_[lane] = r.half_play;
    }
  }
  /// What low-pass and play of the sensors leave of a displacement, the time of span() after the last one.
  Vector read(int lane, SensorMemory<Lane>& kept, Vector value, bool first) const noexcept {
    const auto of = [lane](const Lane& l) { return load(&l.v[0] + lane); };
    SensorMemory<Vector> m{of(kept.input), of(kept.passed), of(kept.read)};
    if (first) {
      m.start(value);
    } else {
      const struct { Vector keep, before, now, half_play; } r{of(keep_), of(before_), of(now_), of(half_sensor_)};
      m.follow(r, value, [](Vector v, Vector limit) { return clamped(v, limit); });
    }
    store(&kept.input.v[0] + lane, m.input);
    store(&kept.passed.v[0] + lane, m.passed);
    store(&kept.read.v[0] + lane, m.read);
    return m.read;
  }

 private:
  Tables own_;
  bool slews_ = false, plays_ = false;
  Lane most_change_;  // N per tick
  Lane half_play_;    // N
  double time_ = -1;
  Lane keep_, before_, now_, half_sensor_;
};

}  // namespace whirl::rig
