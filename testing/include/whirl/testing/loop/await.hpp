#pragma once
#include <chrono>
#include <thread>

namespace whirl::testing {

/// Asks every 20 ms until `done()` is true; false after ten minutes, more than the busiest machine needs for what tests
/// wait for.
template <class Done>
bool await(Done&& done) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(10);
  while (!done()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

}  // namespace whirl::testing
