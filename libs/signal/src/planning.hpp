#pragma once
#include <mutex>

namespace whirl::signal {

/// FFTW may plan, and destroy a plan, in one thread at a time, whatever the plans are of; it may execute in many.
inline std::mutex& planning() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace whirl::signal
