#pragma once
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace whirl {

/// Freed memory stays with the process, up to half a gigabyte, and is used again. glibc gives it back to the system at
/// once otherwise, and every array of the next step of a loop is mapped, cleared and faulted in anew: up to two thirds
/// of the processor time of a program whose matrices are a few hundred kilobytes. For programs, at their beginning; a
/// library leaves the allocator to its host. Limits that the environment names (MALLOC_TRIM_THRESHOLD_) are overruled.
inline void keep_freed_memory() noexcept {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the largest that glibc takes
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
  mallopt(M_TOP_PAD, 4 << 20);
#endif
}

}  // namespace whirl
