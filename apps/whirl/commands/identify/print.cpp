#include "print.hpp"

#include <fmt/format.h>

#include <cmath>

#include "whirl/report/format.hpp"

namespace whirl::app {

std::string show(const Estimate& estimate, std::string_view unit) {
  std::string text = report::format_estimate(estimate, unit);
  if (std::isfinite(estimate.low)) text += fmt::format("   95 % [{:.6g}, {:.6g}]", estimate.low, estimate.high);
  return text;
}

}  // namespace whirl::app
