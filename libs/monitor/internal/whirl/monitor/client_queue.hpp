#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <utility>

#include "whirl/monitor/frame.hpp"

namespace whirl::monitor {

/// Messages that wait for one client. Bounded: when a client is slow the oldest frame goes and is counted, so that it
/// slows neither the hub nor another client. Text, which carries events, goes only when nothing else waits.
/// Thread-safe.
class ClientQueue {
 public:
  /// `wake` is called after a push, from the pushing thread, outside the lock.
  explicit ClientQueue(std::size_t capacity, std::function<void()> wake = {})
      : capacity_(capacity), wake_(std::move(wake)) {}

  void push(MessagePtr message) {
    {
      const std::lock_guard lock(mutex_);
      if (messages_.size() == capacity_) {
        ++dropped_;
        auto oldest = std::find_if(messages_.begin(), messages_.end(), [](const MessagePtr& m) { return !m->text; });
        if (oldest == messages_.end()) {
          if (!message->text) return;
          text_lost_ = true;
          oldest = messages_.begin();
        }
        messages_.erase(oldest);
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
  /// Whether text was dropped since the last call.
  bool take_text_lost() {
    const std::lock_guard lock(mutex_);
    return std::exchange(text_lost_, false);
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
  bool text_lost_ = false;
};

}  // namespace whirl::monitor
