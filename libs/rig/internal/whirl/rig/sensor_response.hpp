#pragma once
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/rig/parameters.hpp"

namespace whirl::rig {

/// Low-pass and play of a displacement sensor between two instants at which its input is known: exact for an input that
/// runs straight between them.
struct SensorResponse {
  double keep = 0, before = 0, now = 1;  ///< weights of the last output, the last input and the input
  double half_play = 0;

  SensorResponse() = default;
  SensorResponse(const RigLaser& laser, double dt) noexcept : half_play(0.5 * laser.hysteresis) {
    if (!(laser.bandwidth > 0 && dt > 0)) return;
    const double rate = kTwoPi * laser.bandwidth;
    keep = std::exp(-rate * dt);
    const double part = (1 - keep) / (rate * dt);
    before = part - keep, now = 1 - part;
  }
};

/// Whether there is something to follow at all.
inline bool has_response(const RigLaser& laser) noexcept { return laser.bandwidth > 0 || laser.hysteresis > 0; }

/// What one sensor remembers: its input, what the low-pass and what the play left of it. V: double or a vector.
template <class V>
struct SensorMemory {
  V input{}, passed{}, read{};

  void start(V value) noexcept { input = passed = read = value; }
  /// `r`: SensorResponse, or one with a number per machine.
  template <class Response, class Clamped>
  void follow(const Response& r, V value, const Clamped& clamped) noexcept {
    passed = r.keep * passed + r.before * input + r.now * value;
    input = value;
    read = passed + clamped(read - passed, r.half_play);
  }
};

}  // namespace whirl::rig
