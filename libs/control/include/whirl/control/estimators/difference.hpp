#pragma once
#include "whirl/control/estimators/input.hpp"

namespace whirl::control {

/// Backward difference with a first-order low-pass: v[k] = q v[k-1] + (1 - q)(z[k] - z[k-1])/h, q = exp(-2 pi
/// fc h); fc infinite (q = 0) gives the plain difference. Delay h/2 plus 1/(2 pi fc).
class FilteredDifference {
 public:
  FilteredDifference(double cutoff_hz, double sample_time) noexcept;
  DiskMotion step(const EstimatorInput& in) noexcept;
  void reset() noexcept {
    started_ = false;
    v_ = {};
  }

 private:
  double pole_, h_;
  std::complex<double> last_, v_;
  bool started_ = false;
};

}  // namespace whirl::control
