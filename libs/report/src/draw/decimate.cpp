#include "whirl/report/decimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace whirl::report {

using Eigen::Index;

std::vector<Index> decimate_columns(const Eigen::Ref<const Eigen::VectorXd>& x,
                                    const Eigen::Ref<const Eigen::VectorXd>& y, double x_low, double x_high,
                                    int columns) {
  std::vector<Index> kept;
  if (x.size() == 0) return kept;
  const double* begin = x.data();
  const double* end = begin + x.size();
  Index from = std::lower_bound(begin, end, x_low) - begin;
  Index to = std::upper_bound(begin, end, x_high) - begin;  // one past the last inside
  from = std::max<Index>(0, from - 1);
  to = std::min<Index>(x.size(), to + 1);
  const double per_x = columns / (x_high - x_low);
  const auto column_of = [&](Index i) { return std::floor((x(i) - x_low) * per_x); };

  Index i = from;
  while (i < to) {
    if (!std::isfinite(y(i))) {
      kept.push_back(i);
      while (i < to && !std::isfinite(y(i))) ++i;
      continue;
    }
    const double column = column_of(i);
    const Index first = i;
    Index smallest = i, largest = i, last = i;
    for (; i < to && std::isfinite(y(i)) && column_of(i) == column; ++i) {
      if (y(i) < y(smallest)) smallest = i;
      if (y(i) > y(largest)) largest = i;
      last = i;
    }
    Index group[4] = {first, std::min(smallest, largest), std::max(smallest, largest), last};
    for (const Index index : group) {
      if (kept.empty() || kept.back() < index) kept.push_back(index);
    }
  }
  return kept;
}

Eigen::Matrix2Xd min_max(const Eigen::Ref<const Eigen::VectorXd>& samples, Index columns) {
  columns = std::min(columns, samples.size());
  Eigen::Matrix2Xd out(2, columns);
  for (Index c = 0; c < columns; ++c) {
    const Index from = c * samples.size() / columns;
    const Index to = (c + 1) * samples.size() / columns;
    double low = std::numeric_limits<double>::quiet_NaN(), high = low;
    for (Index i = from; i < to; ++i) {
      if (!std::isfinite(samples(i))) continue;
      if (!(samples(i) >= low)) low = samples(i);
      if (!(samples(i) <= high)) high = samples(i);
    }
    out(0, c) = low;
    out(1, c) = high;
  }
  return out;
}

}  // namespace whirl::report
