#pragma once
#include <string>

#include "whirl/core/error.hpp"

namespace whirl::testing {

/// The message of the Error that f ends in, or "no error".
template <class F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

}  // namespace whirl::testing
