#pragma once
#include <string>
#include <vector>

#include "formats/text_lines.hpp"
#include "whirl/io/uff.hpp"

namespace whirl::io {

/// The line -1 that opens and closes a block.
inline bool is_delimiter(std::string_view line) { return trim(line) == "-1"; }

/// How the header of dataset 58b says that its values stand.
struct UffBinary {
  bool binary = false;
  bool little = true;
  std::size_t bytes = 0;
};

/// The values of a function behind its header, `per_value` numbers each. What the byte count says and the block does
/// not hold goes into `warnings`. Throws Error for numbers that are not finite.
std::vector<double> binary_numbers(TextLines& lines, const UffBinary& form, const UffFunction& f, std::size_t per_value,
                                   std::vector<std::string>& warnings);

}  // namespace whirl::io
