#pragma once
#include <string>
#include <vector>

namespace whirl::expr {

/// The terms of a list such as "x*abs(x), max(x, v)": split at the commas outside parentheses, without the blanks
/// around them and without empty ones.
std::vector<std::string> split_terms(const std::string& list);

}  // namespace whirl::expr
