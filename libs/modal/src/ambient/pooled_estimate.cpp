#include "pooled_estimate.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/distributions.hpp"

namespace whirl::modal {
namespace {

// Weighted mean and the weighted sum of squares about it.
struct Weighted {
  double mean = 0, weight = 0, squares = 0;
};

Weighted weigh(const std::vector<Estimate>& seen, double between2) {
  Weighted w;
  for (const Estimate& e : seen) {
    const double one = 1 / (e.sd * e.sd + between2);
    w.weight += one;
    w.mean += one * e.value;
  }
  w.mean /= w.weight;
  for (const Estimate& e : seen) w.squares += std::pow(e.value - w.mean, 2) / (e.sd * e.sd + between2);
  return w;
}

}  // namespace

double chance_of(double squares, double freedom, int blocks) {
  return fisher_f_tail(freedom, std::max(1, blocks - 1), squares / freedom);
}

PooledEstimate pool(const std::vector<Estimate>& seen, int blocks, double between) {
  PooledEstimate result;
  if (seen.size() == 1) {
    result.mean = seen.front();
    return result;
  }
  const double freedom = static_cast<double>(seen.size()) - 1;
  const Weighted fixed = weigh(seen, 0);
  double sum2 = 0;
  for (const Estimate& e : seen) sum2 += std::pow(e.sd, -4);
  const double between2 = std::max(between * between, (fixed.squares - freedom) / (fixed.weight - sum2 / fixed.weight));
  result.between = std::sqrt(between2);
  result.squares = fixed.squares;
  result.probability = chance_of(fixed.squares, freedom, blocks);
  const Weighted w = weigh(seen, between2);
  const double sd = std::sqrt(std::max(1.0, w.squares / freedom) / w.weight);
  const double t = result.probability < 0.01 || between > 0 ? students_t_quantile(freedom, 0.975)
                                                            : students_t_quantile(freedom + blocks - 1.0, 0.975);
  result.mean = {w.mean, sd, w.mean - t * sd, w.mean + t * sd};
  return result;
}

}  // namespace whirl::modal
