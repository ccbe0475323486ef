#include "whirl/pages/estimate_text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "whirl/report/format.hpp"

namespace whirl::pages {

std::string estimate_text(const Estimate& estimate, std::string_view unit) {
  std::string text = report::format_estimate(estimate, unit);
  if (std::isfinite(estimate.low)) text += fmt::format("   95 % [{:.6g}, {:.6g}]", estimate.low, estimate.high);
  return text;
}

}  // namespace whirl::pages
