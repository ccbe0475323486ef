#pragma once
#include <array>
#include <atomic>
#include <type_traits>

namespace whirl::rt {

/// The newest value from one thread to another, without locks or waiting: three slots, of which each side owns one and
/// the third changes hands. What was not fetched in time is replaced.
template <class T>
class LatestValue {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  void put(const T& value) noexcept {
    slots_[write_] = value;
    write_ = middle_.exchange(write_ | kFresh, std::memory_order_acq_rel) & kSlot;
  }
  /// False, and nothing happens, when nothing new was put since.
  bool take(T& value) noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    read_ = middle_.exchange(read_, std::memory_order_acq_rel) & kSlot;
    value = slots_[read_];
    return true;
  }

 private:
  static constexpr unsigned kSlot = 3, kFresh = 4;
  std::array<T, 3> slots_{};
  unsigned write_ = 0, read_ = 1;
  std::atomic<unsigned> middle_{2};
};

}  // namespace whirl::rt
