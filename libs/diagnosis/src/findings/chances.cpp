#include <algorithm>
#include <cmath>

#include "findings/line_block.hpp"
#include "whirl/core/distributions.hpp"

namespace whirl::diagnosis::detail {
namespace {

constexpr double kLeastChance = 1e-300;
constexpr double kSeenAlone = 0.01;
constexpr std::size_t kLeastToDrop = 4;        // blocks
constexpr std::size_t kShort = 4, kLong = 12;  // blocks of a stretch
constexpr std::size_t kShortStep = 2, kLongStep = 6;

double without_best(std::vector<double> chances) {
  if (chances.size() >= kLeastToDrop) chances.erase(std::ranges::min_element(chances));
  return fisher(chances);
}

}  // namespace

double exceedance(double power, std::vector<double> floor) {
  std::ranges::sort(floor);
  const std::size_t m = floor.size(), k = (3 * m + 3) / 4;
  double sum = 0, log_chance = 0;
  for (std::size_t i = 0; i < k; ++i) sum += floor[i];
  if (!(sum > 0)) return power > 0 ? kLeastChance : 1;
  for (std::size_t i = 0; i < k; ++i)
    log_chance -= std::log1p(power / sum * static_cast<double>(k - i) / static_cast<double>(m - i));
  return std::max(kLeastChance, std::exp(log_chance));
}

double fisher(const std::vector<double>& chances) {
  if (chances.empty()) return 1;
  double sum = 0;
  for (const double p : chances) sum -= std::log(std::max(p, kLeastChance));
  const auto n = static_cast<double>(chances.size());
  // Far out the tail is below what a double holds.
  return sum > 650 ? kLeastChance : std::max(kLeastChance, chi_squared_tail(2 * n, 2 * sum));
}

Evidence evidence_of(const std::vector<double>& chances) {
  Evidence out;
  for (std::size_t k = 0; k < chances.size(); ++k)
    if (chances[k] < kSeenAlone) out.seen.push_back(k);
  double tests = 1, best = without_best(chances);
  for (const auto& [size, step] : {std::pair{kShort, kShortStep}, std::pair{kLong, kLongStep}}) {
    for (std::size_t first = 0; first + size <= chances.size() && chances.size() > size; first += step, ++tests) {
      const auto from = chances.begin() + static_cast<std::ptrdiff_t>(first);
      best = std::min(best, without_best({from, from + static_cast<std::ptrdiff_t>(size)}));
    }
  }
  out.chance = std::min(1.0, best * tests);
  return out;
}

}  // namespace whirl::diagnosis::detail
