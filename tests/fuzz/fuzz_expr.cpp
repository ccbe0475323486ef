// Symbolic terms: any text gives either a term whose printed form reads back to the same, or an Error.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "whirl/core/error.hpp"
#include "whirl/expr/expr.hpp"
#include "whirl/expr/unit.hpp"

namespace {

template <class F>
bool only_errors(F&& f) {
  try {
    f();
    return true;
  } catch (const whirl::Error&) {
    return false;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  only_errors([&] {
    const whirl::Expr term = whirl::Expr::parse(text);
    const std::string printed = term.str();
    if (!only_errors([&] { if (!(whirl::Expr::parse(printed) == term)) std::abort(); })) std::abort();
  });
  only_errors([&] {
    const std::string printed = whirl::Unit::parse(text).str();
    if (!only_errors([&] { whirl::Unit::parse(printed); })) std::abort();
  });
  return 0;
}
