#pragma once
#include <string_view>

#include "whirl/io/uff.hpp"

namespace whirl::io {

/// Record 6 of dataset 58: `TYPE ID VERSION LOAD NAME NODE DIRECTION NAME NODE DIRECTION`, in columns. A name of more
/// than its ten columns moves what stands behind it. Reads such a line by blanks into type and points of `f` and
/// returns true; false, and nothing read, where its names keep their columns or the words do not fit.
bool read_points_by_blanks(std::string_view line, UffFunction& f);

}  // namespace whirl::io
