#pragma once
#include <algorithm>
#include <cmath>

#include "whirl/core/control_types.hpp"
#include "whirl/core/expected.hpp"

namespace whirl {

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

/// One safety decision as a pure function of reading, request and memory. A trip latches: the command is zero
/// from this tick on until the state is cleared by hand. Written so that NaN trips.
/// `outside`: a reason found by clock or rig (overrun, watchdog).
inline SafetyDecision decide(const SafetyLimits& limits, const SafetyState& state, const Measurement& m,
                             const Expected<Command, Fault>& request, long tick,
                             Fault outside = Fault::none) noexcept {
  SafetyDecision out{{}, state, false};
  out.state.invalid = m.valid ? 0 : state.invalid + 1;
  Fault reason = state.trip != Fault::none ? state.trip : outside;
  if (reason == Fault::none && m.valid && limits.displacement > 0 &&
      !(std::abs(m.x) <= limits.displacement && std::abs(m.y) <= limits.displacement)) {
    reason = std::isnan(m.x) || std::isnan(m.y) ? Fault::not_finite : Fault::displacement_limit;
  }
  if (reason == Fault::none && limits.stale > 0 && out.state.invalid > limits.stale)
    reason = Fault::stale_sensor;
  if (reason == Fault::none && !request) reason = request.error();
  if (reason == Fault::none && !(std::isfinite(request->ux) && std::isfinite(request->uy)))
    reason = Fault::not_finite;
  if (reason != Fault::none) {
    if (state.trip == Fault::none) out.state.trip_tick = tick;
    out.state.trip = reason;
    out.state.last = {};
    return out;
  }
  const auto bound = [&](double u, double last) {
    if (limits.force > 0) u = std::clamp(u, -limits.force, limits.force);
    if (limits.slew > 0) u = std::clamp(u, last - limits.slew, last + limits.slew);
    return u;
  };
  out.command = {bound(request->ux, state.last.ux), bound(request->uy, state.last.uy)};
  out.limited = out.command.ux != request->ux || out.command.uy != request->uy;
  out.state.last = out.command;
  return out;
}

}  // namespace whirl
