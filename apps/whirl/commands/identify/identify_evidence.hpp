#pragma once
#include <string>

#include "whirl/identify/identify.hpp"

namespace whirl::app {

/// Lines for a person: chi-square, condition number, collinear groups, held-out error.
std::string describe(const identification::Evidence& evidence, const Summary& summary);
/// "0.0221" or "diverges".
std::string show_error(double value);

}  // namespace whirl::app
