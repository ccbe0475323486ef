#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "whirl/testing/paths.hpp"

namespace whirl::testing {

/// A file of the measured data set: below $WHIRL_DATA, or the directory given at configure time.
inline std::filesystem::path data_file(const std::filesystem::path& relative) {
  const char* root = std::getenv("WHIRL_DATA");
  return std::filesystem::path(root != nullptr ? root : data_dir()) / relative;
}

}  // namespace whirl::testing

/// Skips a reference test, saying why, on machines without the measured data (which the project may not redistribute).
#define WHIRL_REQUIRE_DATA(path)                                                                    \
  do {                                                                                              \
    if (!std::filesystem::exists(path))                                                             \
      GTEST_SKIP() << "measured data not present: " << (path) << " (set WHIRL_DATA to its folder)"; \
  } while (0)
