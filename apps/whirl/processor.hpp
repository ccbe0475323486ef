#pragma once

namespace whirl::app {

/// Packages may hold this program twice: for every processor of its kind, and for those with AVX2 and FMA (x86-64-v3:
/// Intel from 2013, AMD from 2015), on which it computes faster. The first, started on such a processor, goes on as the
/// second, PREFIX/libexec/whirl/x86-64-v3/whirl. Returns where there is none, and in the second itself.
void go_on_as_the_faster_build(char** argv) noexcept;

}  // namespace whirl::app
