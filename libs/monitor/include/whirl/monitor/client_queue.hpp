#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>

#include "whirl/monitor/frame.hpp"

namespace whirl::monitor {

/// Messages that wait for one client. Bounded: when a client is slow the oldest message goes and is counted, so that it
/// slows neither the hub nor another client. Thread-safe.
class ClientQueue {
 public:
  /// `wake` is called after a push, from the pushing thread, outside the lock.
  explicit ClientQueue(std::size_t capacity, std::function<void()> wake = {})
      : capacity_(capacity), wake_(std::move(wake)) {}

  void push(MessagePtr message) {
    {
      const std::lock_guard lock(mutex_);
      if (messages_.size() == capacity_) {
        messages_.pop_front();
        ++dropped_;
      }
      messages_.push_back(std::move(message));
    }
    if (wake_) wake_();
  }
  /// The oldest message, or null.
  MessagePtr pop() {
    const std::lock_guard lock(mutex_);
    if (messages_.empty()) return nullptr;
    MessagePtr message = std::move(messages_.front());
    messages_.pop_front();
    return message;
  }
  std::uint64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  std::size_t capacity_;
  std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::deque<MessagePtr> messages_;
  std::uint64_t dropped_ = 0;
};

}  // namespace whirl::monitor
