#include "processor.hpp"

#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <string_view>

namespace whirl::app {

// GCC names the level as a whole; Clang 14 does not know it.
#if defined(__x86_64__) && defined(__linux__) && !defined(__AVX2__) && !defined(__clang__)

void go_on_as_the_faster_build(char** argv) noexcept {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("x86-64-v3") == 0) return;
  constexpr std::string_view from = "/bin/whirl", to = "/libexec/whirl/x86-64-v3/whirl";
  std::array<char, 4096> path{};
  const ssize_t read = readlink("/proc/self/exe", path.data(), path.size());
  if (read < 0) return;
  const std::string_view self(path.data(), static_cast<std::size_t>(read));
  const std::size_t prefix = self.size() - from.size();
  if (!self.ends_with(from) || prefix + to.size() >= path.size()) return;
  std::memcpy(path.data() + prefix, to.data(), to.size());
  path[prefix + to.size()] = '\0';
  execv(path.data(), argv);  // returns only where there is no such program
}

#else

void go_on_as_the_faster_build(char**) noexcept {}

#endif

}  // namespace whirl::app
