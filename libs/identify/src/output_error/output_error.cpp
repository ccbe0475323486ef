#include "output_error/output_error.hpp"

namespace whirl::identification::detail {

void add_run(const SquareSum& run, const std::vector<Eigen::Index>& unknowns, SquareSum& all) {
  all.cost += run.cost;
  for (std::size_t a = 0; a < unknowns.size(); ++a) {
    all.gradient[unknowns[a]] += run.gradient[static_cast<Eigen::Index>(a)];
    for (std::size_t b = 0; b <= a; ++b) {
      const double v = run.normal(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
      all.normal(unknowns[a], unknowns[b]) += v;
      if (a != b) all.normal(unknowns[b], unknowns[a]) += v;
    }
  }
}

}  // namespace whirl::identification::detail
