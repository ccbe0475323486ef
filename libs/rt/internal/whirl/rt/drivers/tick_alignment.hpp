#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace whirl::rt {

/// How far the ticks of one clock are ahead of those of another, learned from the newest tick of both as they arrive
/// here: a board and a laser on lines of their own.
///
/// The sample of the second belongs to the tick that had come from the first before it, so that a smaller difference
/// is nearer to the truth than a larger one, which only says that the second was late. The first may be late too,
/// though seldom: a network or a busy machine held its ticks back. Then the difference is too small, once for each such
/// tick. So each tick of the first counts once, with its smallest difference, and the answer is the one that a
/// sixteenth of the last 128 ticks stay below: a second clock whose samples come in bunches of 16 ticks is still
/// aligned, and 8 ticks that were held back do no harm. What came before those 128 ticks is forgotten, such as a clock
/// that was set since.
class TickAlignment {
 public:
  /// `tick` is the newest of the first clock, `difference` the ticks from the newest of the second to it.
  void see(std::int64_t tick, std::int64_t difference) noexcept {
    if (known_ > 0 && tick == tick_) {
      std::int64_t& newest = differences_[(next_ + kWindow - 1) % kWindow];
      newest = std::min(newest, difference);
    } else {
      differences_[next_] = difference;
      next_ = (next_ + 1) % kWindow;
      known_ = std::min(known_ + 1, kWindow);
    }
    tick_ = tick;
    auto sorted = differences_;
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(known_ / kShare);
    std::nth_element(sorted.begin(), at, sorted.begin() + static_cast<std::ptrdiff_t>(known_));
    offset_ = *at;
  }
  /// The second clock was found to run apart: everything seen is moved by `ticks`.
  void move(std::int64_t ticks) noexcept {
    for (std::int64_t& d : differences_) d += ticks;
    offset_ += ticks;
  }
  bool known() const noexcept { return known_ > 0; }
  /// Ticks of the first clock minus ticks of the second; 0 when nothing is known.
  std::int64_t offset() const noexcept { return offset_; }

 private:
  static constexpr std::size_t kWindow = 128, kShare = 16;
  std::array<std::int64_t, kWindow> differences_{};
  std::size_t next_ = 0, known_ = 0;
  std::int64_t tick_ = 0, offset_ = 0;
};

}  // namespace whirl::rt
