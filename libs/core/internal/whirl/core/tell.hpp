#pragma once
#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <utility>

namespace whirl {

/// Says something on stderr while something else goes on that an stderr which cannot be written to must not end.
template <class... Arguments>
void tell(fmt::format_string<Arguments...> format, Arguments&&... arguments) noexcept {
  try {
    fmt::print(stderr, format, std::forward<Arguments>(arguments)...);
  } catch (...) {  // nobody reads it
  }
}

/// While this lives, output that nobody takes any more (a closed pipe) is an error and not the end of the program.
class BrokenPipeIgnored {
 public:
  BrokenPipeIgnored() noexcept {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    known_ = sigaction(SIGPIPE, &ignore, &before_) == 0;
  }
  ~BrokenPipeIgnored() {
    if (known_) sigaction(SIGPIPE, &before_, nullptr);
  }
  BrokenPipeIgnored(const BrokenPipeIgnored&) = delete;
  BrokenPipeIgnored& operator=(const BrokenPipeIgnored&) = delete;

 private:
  struct sigaction before_ {};
  bool known_ = false;
};

}  // namespace whirl
