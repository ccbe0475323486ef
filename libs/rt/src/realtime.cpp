#include "whirl/rt/realtime.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>
#ifdef __SSE__
#include <immintrin.h>
#endif

#include <array>
#include <cerrno>
#include <cstring>

namespace whirl::rt {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

// Pages of the stack exist from now on.
__attribute__((noinline)) void touch_stack() {
  std::array<volatile char, 256 * 1024> page;
  for (std::size_t i = 0; i < page.size(); i += 1024) page[i] = 0;
}

}  // namespace

std::int64_t WallTime::now() const noexcept {
  timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * kSecond + t.tv_nsec;
}

void WallTime::sleep_until(std::int64_t ns) const noexcept {
  const timespec t{ns / kSecond, ns % kSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

struct RealtimeThread::Before {
  bool bound = false, scheduled = false;
  cpu_set_t processors;
  int policy = SCHED_OTHER;
  sched_param scheduling{};
};

RealtimeThread::RealtimeThread(const RealtimeOptions& o) : before_(std::make_unique<Before>()) {
  if (o.lock_memory) {
    locked_ = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    if (locked_) {
      granted_.push_back("memory locked");
    } else {
      refused_.push_back(fmt::format("memory is not locked ({}); raise the memlock limit (ulimit -l, limits.conf)",
                                     std::strerror(errno)));
    }
  }
  touch_stack();
  if (o.no_deep_idle) {
    idle_handle_ = ::open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    const std::int32_t zero = 0;
    if (idle_handle_ >= 0 && ::write(idle_handle_, &zero, sizeof zero) == sizeof zero) {
      granted_.push_back("no deep idle states");
    } else {
      refused_.push_back(
          fmt::format("deep idle states stay allowed (/dev/cpu_dma_latency: {}); give this user write access",
                      std::strerror(errno)));
    }
  }
  if (o.cpu >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<unsigned>(o.cpu), &set);
    int error = pthread_getaffinity_np(pthread_self(), sizeof before_->processors, &before_->processors);
    if (error == 0) error = pthread_setaffinity_np(pthread_self(), sizeof set, &set);
    before_->bound = error == 0;
    if (before_->bound) {
      granted_.push_back(fmt::format("on processor {}", o.cpu));
    } else {
      refused_.push_back(fmt::format("not bound to processor {} ({})", o.cpu, std::strerror(error)));
    }
  }
  if (o.priority > 0) {
    sched_param p{};
    p.sched_priority = o.priority;
    int error = pthread_getschedparam(pthread_self(), &before_->policy, &before_->scheduling);
    if (error == 0) error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &p);
    before_->scheduled = error == 0;
    if (before_->scheduled) {
      granted_.push_back(fmt::format("SCHED_FIFO {}", o.priority));
    } else {
      refused_.push_back(
          fmt::format("no SCHED_FIFO {} ({}); raise the rtprio limit (ulimit -r, limits.conf) or give the "
                      "program CAP_SYS_NICE",
                      o.priority, std::strerror(error)));
    }
  }
#ifdef __SSE__
  control_ = _mm_getcsr();
  _mm_setcsr(control_ | 0x8040);  // flush to zero, denormals are zero
  granted_.push_back("denormals flushed");
#endif
}

RealtimeThread::~RealtimeThread() {
#ifdef __SSE__
  _mm_setcsr(control_);
#endif
  if (before_->scheduled) pthread_setschedparam(pthread_self(), before_->policy, &before_->scheduling);
  if (before_->bound) pthread_setaffinity_np(pthread_self(), sizeof before_->processors, &before_->processors);
  if (idle_handle_ >= 0) ::close(idle_handle_);
  if (locked_) munlockall();
}

}  // namespace whirl::rt
