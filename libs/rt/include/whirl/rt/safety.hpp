#pragma once
#include <algorithm>
#include <cmath>

#include "whirl/core/control_types.hpp"
#include "whirl/core/expected.hpp"

namespace whirl::rt {

/// What the loop itself guarantees, whatever the controller asks for. SI; 0 switches a limit off.
struct SafetyLimits {
  double force = 0;         ///< |ux|, |uy|, N
  double slew = 0;          ///< change of the force per tick, N
  double displacement = 0;  ///< trip when |x| or |y| of a valid reading exceeds this, m
  long stale = 100;         ///< trip after more than this many invalid readings in a row; 0 = never
};

/// What the decision remembers from tick to tick.
struct SafetyState {
  Fault trip = Fault::none;  ///< latched
  long trip_tick = -1;
  long invalid = 0;  ///< invalid readings in a row
  Command last;      ///< force sent last
};

struct SafetyDecision {
  Command command;  ///< to send: the limited request, or zero when tripped
  SafetyState state;
  bool limited = false;  ///< force or slew limit acted
};

/// The trip that a reading alone demands. Written so that NaN trips.
inline Fault displacement_fault(const SafetyLimits& limits, const Measurement& m) noexcept {
  if (!m.valid || limits.displacement <= 0) return Fault::none;
  if (std::abs(m.x) <= limits.displacement && std::abs(m.y) <= limits.displacement) return Fault::none;
  return std::isnan(m.x) || std::isnan(m.y) ? Fault::not_finite : Fault::displacement_limit;
}

/// Clamps both forces; true when that changed one.
inline bool limit_force(const SafetyLimits& limits, Command& u) noexcept {
  if (limits.force <= 0) return false;
  const Command asked = u;
  u = {std::clamp(u.ux, -limits.force, limits.force), std::clamp(u.uy, -limits.force, limits.force)};
  return u.ux != asked.ux || u.uy != asked.uy;
}

/// One safety decision as a pure function of reading, request and memory. A trip latches: the command is zero
/// from this tick on until the state is cleared by hand. Written so that NaN trips.
/// `outside`: a reason found by clock or rig (overrun, watchdog).
inline SafetyDecision decide(const SafetyLimits& limits, const SafetyState& state, const Measurement& m,
                             const Expected<Command, Fault>& request, long tick, Fault outside = Fault::none) noexcept {
  SafetyDecision out{.command = {}, .state = state};
  out.state.invalid = m.valid ? 0 : state.invalid + 1;
  Fault reason = state.trip != Fault::none ? state.trip : outside;
  if (reason == Fault::none) reason = displacement_fault(limits, m);
  if (reason == Fault::none && limits.stale > 0 && out.state.invalid > limits.stale) reason = Fault::stale_sensor;
  if (reason == Fault::none && !request) reason = request.error();
  if (reason == Fault::none && !(std::isfinite(request->ux) && std::isfinite(request->uy))) reason = Fault::not_finite;
  if (reason != Fault::none) {
    if (state.trip == Fault::none) out.state.trip_tick = tick;
    out.state.trip = reason;
    out.state.last = {};
    return out;
  }
  out.command = *request;
  out.limited = limit_force(limits, out.command);
  if (limits.slew > 0) {
    const auto near = [&](double u, double last) { return std::clamp(u, last - limits.slew, last + limits.slew); };
    out.command = {near(out.command.ux, state.last.ux), near(out.command.uy, state.last.uy)};
    out.limited = out.command.ux != request->ux || out.command.uy != request->uy;
  }
  out.state.last = out.command;
  return out;
}

}  // namespace whirl::rt
