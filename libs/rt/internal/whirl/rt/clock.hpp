#pragma once

namespace whirl::rt {

/// Clock that advances only when the loop waits for it: as fast as possible and deterministic.
class SimulatedClock {
 public:
  explicit SimulatedClock(double period) noexcept : period_(period) {}
  /// Waits for the next tick; returns the number of ticks that passed unused (always 0 here).
  long wait() noexcept {
    ++tick_;
    return 0;
  }
  long tick() const noexcept { return tick_; }
  double now() const noexcept { return static_cast<double>(tick_) * period_; }  ///< s

 private:
  double period_;
  long tick_ = -1;
};

}  // namespace whirl::rt
