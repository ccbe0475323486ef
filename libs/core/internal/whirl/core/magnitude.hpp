#pragma once
#include "whirl/core/estimate.hpp"

namespace whirl {

/// 95 % interval of the size of a vector that was measured as `value`, `sd` the standard deviation of each of its two
/// components. Of many standard deviations it is value +- 1.96 sd. Near zero the size of the measured vector is larger
/// than that of the true one, and a size is never negative: there the ends are the sizes under which a measured one as
/// large, or as small, has a chance of 2.5 % (Rice's law). `low` is 0 up to 2.716 sd: no different from zero.
/// At zero itself, where no such upper end exists, `high` is 1.96 sd.
Estimate magnitude_estimate(double value, double sd);

}  // namespace whirl
