#include "evidence/verdict.hpp"

#include <fmt/format.h>

namespace whirl::identification::detail {

bool judge_unexplained(double unexplained, const std::string& run, const std::string& cause, Summary& summary) {
  constexpr double kUnusable = 0.15;
  if (unexplained < kUnusable) return true;
  summary.fail(
      fmt::format("{} {:.0f} % of the motion unexplained beyond the noise: {}", run, 100 * unexplained, cause));
  return false;
}

bool judge_chi_square(double chi_square, const std::string& consequence, Summary& summary) {
  constexpr double kModelError = 1.3;
  if (!(chi_square > kModelError)) return false;
  summary.warn(fmt::format("model error: chi-square {:.2f} (1 when the model fits){}", chi_square, consequence));
  return true;
}

void set_trust(const std::string& sentence, Summary& summary) {
  summary.trust = summary.status == Status::unusable ? "Do not use this model." : sentence;
}

}  // namespace whirl::identification::detail
