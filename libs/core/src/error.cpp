#include "whirl/core/error.hpp"

#include <fmt/format.h>

namespace whirl {

Error Error::in_file(std::string_view file, long line, std::string_view message) {
  return line > 0 ? Error(fmt::format("{}:{}: {}", file, line, message)) : Error(fmt::format("{}: {}", file, message));
}

Error Error::in_field(std::string_view field, std::string_view value, std::string_view allowed) {
  return Error(fmt::format("{} = {}: must be {}", field, value, allowed));
}

void require_range(std::string_view field, double value, double low, double high, std::string_view unit) {
  if (!(value >= low && value <= high)) {
    throw Error(fmt::format("{} = {:g}{}{}: must be between {:g} and {:g}", field, value, unit.empty() ? "" : " ", unit,
                            low, high));
  }
}

}  // namespace whirl
