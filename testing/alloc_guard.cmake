# whirl_alloc_guard: link it into a test program that uses whirl/testing/alloc_guard.hpp.
include_guard(GLOBAL)
add_library(whirl_alloc_guard OBJECT "${CMAKE_CURRENT_LIST_DIR}/src/alloc_guard.cpp")
target_include_directories(whirl_alloc_guard PUBLIC "${CMAKE_CURRENT_LIST_DIR}/include")
target_compile_options(whirl_alloc_guard PRIVATE -fno-builtin-malloc)
target_link_libraries(whirl_alloc_guard PRIVATE whirl_flags)
target_link_options(whirl_alloc_guard INTERFACE
  LINKER:--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=posix_memalign)
