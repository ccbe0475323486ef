#pragma once
#include "whirl/control/controller.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/loop_sample.hpp"

namespace whirl::hardware {

/// Cycle `r`, due at `scheduled` and begun at `started` (ns of the monotonic clock), as it is recorded and shown.
inline rt::LoopSample sample_of(const rt::CycleRecord& r, std::int64_t scheduled, std::int64_t started) noexcept {
  rt::LoopSample s;
  s.tick = r.tick;
  s.t = r.measurement.t;
  s.scheduled = 1e-9 * static_cast<double>(scheduled);
  s.started = 1e-9 * static_cast<double>(started);
  s.x = r.measurement.x, s.y = r.measurement.y;
  s.beta = r.measurement.beta, s.omega = r.measurement.omega, s.omega_dot = r.measurement.omega_dot;
  s.ux = r.sent.ux, s.uy = r.sent.uy;
  s.flags = (r.measurement.valid ? rt::kValid : 0) | (r.armed ? rt::kArmed : 0) | (r.limited ? rt::kLimited : 0) |
            (r.releasing ? rt::kReleasing : 0);
  s.trip = static_cast<std::int32_t>(r.trip);
  s.missed = static_cast<std::int32_t>(r.missed);
  return s;
}

/// What the controller made of it.
inline void add_internals(rt::LoopSample& s, const control::Controller& controller) noexcept {
  const control::ControllerState& c = controller.state();
  s.x_est = c.estimate.z.real(), s.y_est = c.estimate.z.imag();
  s.vx_est = c.estimate.v.real(), s.vy_est = c.estimate.v.imag();
  s.dx_est = c.estimate.d.real(), s.dy_est = c.estimate.d.imag();
  s.s_x = c.s.real(), s.s_y = c.s.imag();
  s.ux_requested = c.requested.real(), s.uy_requested = c.requested.imag();
  s.flags |= (c.saturated ? rt::kSaturated : 0) | (c.held ? rt::kHeld : 0);
  s.flags |= static_cast<std::int32_t>(c.supervision.word << rt::kSupervisionShift);
}

}  // namespace whirl::hardware
