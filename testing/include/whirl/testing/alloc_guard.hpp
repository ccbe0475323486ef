#pragma once
#include <cstddef>

namespace whirl::testing {

/// Counts heap allocations of the calling thread while it lives: operators new, and malloc, calloc, realloc,
/// aligned_alloc, posix_memalign called from the program itself (not from inside shared libraries). The test
/// program must link whirl_alloc_guard (testing/alloc_guard.cmake).
class AllocationGuard {
 public:
  AllocationGuard() noexcept;
  AllocationGuard(const AllocationGuard&) = delete;
  AllocationGuard& operator=(const AllocationGuard&) = delete;

  /// Allocations since construction.
  std::size_t count() const noexcept;

 private:
  std::size_t start_;
};

/// Allocates with malloc and with new in a way the optimiser cannot remove: the positive control of the
/// guard. Two allocations.
void allocate_twice();

}  // namespace whirl::testing
