#pragma once
#include <atomic>
#include <cstdint>
#include <vector>

namespace whirl::monitor {

/// Samples from one real-time producer to one consumer, without locks: push() is wait-free, allocates nothing, and when
/// the ring is full it refuses the sample and counts it, so the loop never waits for the view. One row per control
/// tick.
class SampleRing {
 public:
  /// `capacity` is rounded up to a power of two. All memory is taken here.
  SampleRing(std::size_t channels, std::size_t capacity);

  std::size_t channels() const noexcept { return channels_; }
  std::size_t capacity() const noexcept { return mask_ + 1; }

  /// Producer: one row of `channels()` values for control tick `tick` (ascending; gaps are allowed). False when full.
  bool push(std::uint64_t tick, const double* values) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) > mask_) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    const std::size_t slot = head & mask_;
    ticks_[slot] = tick;
    double* row = &values_[slot * channels_];
    for (std::size_t c = 0; c < channels_; ++c) row[c] = values[c];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Consumer: copies the oldest row and its tick. False when empty.
  bool pop(std::uint64_t& tick, double* values) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    const std::size_t slot = tail & mask_;
    tick = ticks_[slot];
    const double* row = &values_[slot * channels_];
    for (std::size_t c = 0; c < channels_; ++c) values[c] = row[c];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  /// Consumer: tick of the oldest row without taking it. False when empty.
  bool peek(std::uint64_t& tick) const noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    tick = ticks_[tail & mask_];
    return true;
  }

  /// Rows refused so far; any thread.
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::size_t channels_, mask_;
  std::vector<std::uint64_t> ticks_;
  std::vector<double> values_;
  // Producer and consumer write to different cache lines.
  alignas(64) std::atomic<std::uint64_t> head_{0};
  alignas(64) std::atomic<std::uint64_t> tail_{0};
  alignas(64) std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace whirl::monitor
