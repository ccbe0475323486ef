#pragma once
#include <algorithm>
#include <atomic>
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

/// Trials of which each may end the rest: run(i) for i in [0, n) side by side, as many at a time as there are cores but
/// at most `most`, and take(i) in the order of i until ended() is true. What is taken is the same for any number of
/// cores; what was run in vain is dropped. run(i) must write to slot i alone, and ended() must stay true.
template <class Ended, class Run, class Take>
void parallel_trials(int n, int most, Ended&& ended, Run&& run, Take&& take) {
  const int group = std::min(most, processors());
  for (int first = 0; first < n && !ended(); first += group) {
    const int last = std::min(n, first + group);
    parallel_for(last - first, group, [&](int i) { run(first + i); });
    for (int i = first; i < last && !ended(); ++i) take(i);
  }
}

}  // namespace whirl
