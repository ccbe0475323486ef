#pragma once
#include <utility>

namespace whirl {

/// As many numbers as are worth adding and multiplying at once; where registers are narrower the compiler splits them.
#ifdef __AVX512F__
constexpr int kRegisterWidth = 8;
#else
constexpr int kRegisterWidth = 4;
#endif
constexpr int kRegisterBytes = kRegisterWidth * static_cast<int>(sizeof(double));
/// Aligned to its size. Built for every processor, the type alone has the alignment of narrow registers, and the code
/// for wide ones ends the program where memory has no more. An argument of a template loses the attribute: `Register
/// parts[n]`, not std::array.
using Register [[gnu::vector_size(kRegisterBytes), gnu::aligned(kRegisterBytes)]] = double;
static_assert(alignof(Register) == kRegisterBytes);

/// @fn whirl::on_wide_registers
/// Calls `work()`, with all of it that is inline compiled for wide registers. Built for every x86-64 processor, a
/// program has registers of two numbers: `work` is compiled a second time for x86-64-v3 (AVX2, FMA: four numbers,
/// multiplied and added at once) and runs so where the processor can. A matrix product of Eigen keeps its two-number
/// kernels.
// Where the whole program is built for a wider processor, the compiler's own choice is kept to four numbers, measured
// to be faster than eight.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#if defined(__AVX2__) && defined(__FMA__)
template <class Work>
[[gnu::target("prefer-vector-width=256"), gnu::flatten, gnu::noinline]] void on_wide_registers(Work&& work) {
  std::forward<Work>(work)();
}
#else
namespace detail {
template <class Work>
[[gnu::target("arch=x86-64-v3"), gnu::flatten, gnu::noinline]] void run_as_v3(Work& work) {
  work();
}
}  // namespace detail

template <class Work>
void on_wide_registers(Work&& work) {
  static const bool can = __builtin_cpu_supports("x86-64-v3");
  if (can)
    detail::run_as_v3(work);
  else
    std::forward<Work>(work)();
}
#endif
#else
template <class Work>
void on_wide_registers(Work&& work) {
  std::forward<Work>(work)();
}
#endif

}  // namespace whirl
