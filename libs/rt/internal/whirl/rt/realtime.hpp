#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace whirl::rt {

/// Monotonic time of this machine.
struct WallTime {
  std::int64_t now() const noexcept;                          ///< ns
  void sleep_until(std::int64_t nanoseconds) const noexcept;  ///< absolute; signals do not end the sleep
};

struct RealtimeOptions {
  int priority = 80;  ///< of SCHED_FIFO, 1 to 99; 0: ordinary scheduling
  int cpu = -1;       ///< processor to stay on; -1: any
  bool lock_memory = true;
  bool no_deep_idle = true;  ///< keep the processors out of sleep states that take long to leave
};

/// Makes the calling thread fit for a periodic loop while the object lives: memory locked and the stack touched,
/// SCHED_FIFO, affinity of this thread alone, no deep idle states, denormal numbers flushed to zero. What the
/// system refuses is listed, each with its remedy, and the loop may go on without. Its end gives affinity and
/// scheduling back as they were.
class RealtimeThread {
 public:
  explicit RealtimeThread(const RealtimeOptions& options);
  ~RealtimeThread();
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;

  const std::vector<std::string>& granted() const { return granted_; }
  const std::vector<std::string>& refused() const { return refused_; }

 private:
  struct Before;  ///< affinity and scheduling of the thread
  std::unique_ptr<Before> before_;
  int idle_handle_ = -1;
  bool locked_ = false;
  unsigned control_ = 0;
  std::vector<std::string> granted_, refused_;
};

}  // namespace whirl::rt
