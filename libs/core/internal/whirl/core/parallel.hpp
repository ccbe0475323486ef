#pragma once
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace whirl {

inline int processors() { return static_cast<int>(std::max(1u, std::thread::hardware_concurrency())); }

/// Calls work(i) for i in [0, n) on up to `threads` threads (0 = all cores). Results must go to slot i: the
/// order of calls is not defined. The first exception is rethrown.
template <class Work>
void parallel_for(int n, int threads, Work&& work) {
  const int count = std::min(n, threads > 0 ? threads : processors());
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex guard;
  const auto loop = [&] {
    for (int i = next++; i < n; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(guard);
        if (!failure) failure = std::current_exception();
      }
    }
  };
  std::vector<std::jthread> pool;
  for (int i = 1; i < count; ++i) pool.emplace_back(loop);
  loop();
  pool.clear();
  if (failure) std::rethrow_exception(failure);
}

/// Trials of which each may end the rest: run(i) for i in [0, n) side by side on all cores, and take(i) in the order of
/// i until ended() is true. At most `most` are running or wait to be taken. What is taken is the same for any number of
/// cores; what was run in vain is dropped. run(i) must write to slot i alone and read nothing that take changes; take
/// and ended are called by one thread at a time, and ended() must stay true.
template <class Ended, class Run, class Take>
void parallel_trials(int n, int most, Ended&& ended, Run&& run, Take&& take) {
  if (n <= 0 || ended()) return;
  std::vector<char> ready(static_cast<std::size_t>(n));
  int next = 0, taken = 0;
  bool end = false;
  std::mutex guard;
  std::condition_variable freed;
  const auto take_ready = [&] {
    while (!end && taken < n && ready[static_cast<std::size_t>(taken)]) {
      take(taken++);
      end = taken == n || ended();
    }
  };
  const auto loop = [&](int) {
    std::unique_lock lock(guard);
    while (true) {
      freed.wait(lock, [&] { return end || next == n || next < taken + most; });
      if (end || next == n) return;
      const int i = next++;
      lock.unlock();
      try {
        run(i);
        lock.lock();
        ready[static_cast<std::size_t>(i)] = 1;
        take_ready();
      } catch (...) {
        if (!lock.owns_lock()) lock.lock();
        end = true;
        freed.notify_all();
        throw;
      }
      freed.notify_all();
    }
  };
  const int threads = std::min({n, most, processors()});
  parallel_for(threads, threads, loop);
}

}  // namespace whirl
