#pragma once
#include "whirl/io/signals.hpp"

namespace whirl {

struct UffFile;
struct AtfxFile;

/// Functions of a universal file; those over the same abscissa make one table.
SignalFile signals_from_uff(const UffFile& file);
/// Numeric columns of an ATFX file, a table per submatrix.
SignalFile signals_from_atfx(const AtfxFile& file);

/// Adds a signal to the table of `file` with the same abscissa (no `x`) and row count, or to a new one.
void add_signal(SignalFile& file, const SignalTable& like, Signal signal);

}  // namespace whirl
