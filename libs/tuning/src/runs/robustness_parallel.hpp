#pragma once
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace whirl::tuning {

/// Calls work(i) for i in [0, n) on up to `threads` threads (0 = all cores). Results must go to slot i: the
/// order of calls is not defined. The first exception is rethrown.
template <class Work>
void parallel_for(int n, int threads, Work&& work) {
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int count = std::min(n, threads > 0 ? threads : cores);
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

}  // namespace whirl::tuning
