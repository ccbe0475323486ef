#pragma once
#include <limits>

namespace whirl {

/// A number with its uncertainty. All in the SI unit of the quantity.
struct Estimate {
  double value = std::numeric_limits<double>::quiet_NaN();
  double sd = std::numeric_limits<double>::quiet_NaN();    ///< standard deviation; NaN when not known
  double low = std::numeric_limits<double>::quiet_NaN();   ///< lower end of the 95 % confidence interval
  double high = std::numeric_limits<double>::quiet_NaN();  ///< upper end

  /// Gaussian 95 % interval.
  static Estimate from_sd(double value, double sd) { return {value, sd, value - 1.959964 * sd, value + 1.959964 * sd}; }
  bool covers(double truth) const { return low <= truth && truth <= high; }
};

}  // namespace whirl
