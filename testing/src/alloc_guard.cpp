// Built with -fno-builtin-malloc: g++ may remove an allocation whose result is unused, and then a broken
// guard would pass.
#include "whirl/testing/alloc_guard.hpp"

#include <cstdlib>
#include <new>

namespace {
thread_local std::size_t allocations = 0;
}

// The linker sends every call of malloc in the program to __wrap_malloc (option --wrap); __real_malloc is the
// library's.
extern "C" {
void* __real_malloc(std::size_t);
void* __real_calloc(std::size_t, std::size_t);
void* __real_realloc(void*, std::size_t);
void* __real_aligned_alloc(std::size_t, std::size_t);
int __real_posix_memalign(void**, std::size_t, std::size_t);

void* __wrap_malloc(std::size_t n) { return ++allocations, __real_malloc(n); }
void* __wrap_calloc(std::size_t n, std::size_t size) { return ++allocations, __real_calloc(n, size); }
void* __wrap_realloc(void* p, std::size_t n) { return ++allocations, __real_realloc(p, n); }
void* __wrap_aligned_alloc(std::size_t a, std::size_t n) { return ++allocations, __real_aligned_alloc(a, n); }
int __wrap_posix_memalign(void** p, std::size_t a, std::size_t n) {
  return ++allocations, __real_posix_memalign(p, a, n);
}
}

namespace {
void* obtain(std::size_t n, std::size_t alignment = 0) {
  if (n == 0) n = 1;
  void* p =
      alignment == 0 ? std::malloc(n) : std::aligned_alloc(alignment, (n + alignment - 1) / alignment * alignment);
  if (p == nullptr) throw std::bad_alloc();
  return p;
}
}  // namespace

void* operator new(std::size_t n) { return obtain(n); }
void* operator new[](std::size_t n) { return obtain(n); }
void* operator new(std::size_t n, std::align_val_t a) { return obtain(n, static_cast<std::size_t>(a)); }
void* operator new[](std::size_t n, std::align_val_t a) { return obtain(n, static_cast<std::size_t>(a)); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

namespace whirl::testing {

AllocationGuard::AllocationGuard() noexcept : start_(allocations) {}
std::size_t AllocationGuard::count() const noexcept { return allocations - start_; }

void allocate_twice() {
  void* volatile p = std::malloc(1);
  std::free(p);
  int* volatile q = new int(1);
  delete q;
}

}  // namespace whirl::testing
