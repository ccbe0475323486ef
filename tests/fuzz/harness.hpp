// What the fuzz targets share: any bytes give either a valid value or a whirl::Error that says something.
#pragma once
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "whirl/core/error.hpp"

namespace whirl::fuzz {

/// Runs f; true when it did not end in an Error.
template <class F>
bool only_errors(F&& f) {
  try {
    f();
    return true;
  } catch (const Error& e) {
    if (std::string_view(e.what()).empty()) std::abort();
    return false;
  }
}

inline void require(bool good) {
  if (!good) std::abort();
}

void run(std::string_view bytes);  ///< the target

}  // namespace whirl::fuzz

// Each target includes this once.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  whirl::fuzz::run({reinterpret_cast<const char*>(data), size});
  return 0;
}
