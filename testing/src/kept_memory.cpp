// Test programs keep freed memory as the program itself does: loops over larger matrices spend less time in page
// faults.
#include "whirl/core/kept_memory.hpp"

namespace {
[[maybe_unused]] const bool kept = (whirl::keep_freed_memory(), true);
}
