#include "whirl/control/estimators/difference.hpp"

#include <limits>

#include "whirl/control/method.hpp"

namespace whirl::control {

FilteredDifference::FilteredDifference(double cutoff_hz, double sample_time) noexcept
    : pole_(std::exp(-2 * std::numbers::pi * cutoff_hz * sample_time)), h_(sample_time) {}

DiskMotion FilteredDifference::step(const EstimatorInput& in) noexcept {
  if (!started_) {
    // A rotor in steady whirl moves at i omega z: the best guess from one sample.
    v_ = product({0, in.omega}, in.z);
    started_ = true;
  } else {
    v_ = pole_ * v_ + (1 - pole_) / h_ * (in.z - last_);
  }
  last_ = in.z;
  return {in.z, v_, in.d};
}

EstimatorEntry difference_estimator() {
  return {.info = {"difference", "backward difference", "", {}},
          .make = [](const ControllerDesign& d, const Parameters&) -> AnyEstimator {
            return FilteredDifference(std::numeric_limits<double>::infinity(), d.sample_time);
          },
          .code = [](const Parameters&) { return CodeFragment{"difference"}; }};
}

EstimatorEntry lpf_estimator() {
  return {.info = {"lpf",
                   "filtered backward difference",
                   "first-order low-pass",
                   {{"cutoff", "Hz", "low-pass of the velocity", 200, 1, 1e5, 30, 450}}},
          .make = [](const ControllerDesign& d, const Parameters& v) -> AnyEstimator {
            return FilteredDifference(v.at("cutoff"), d.sample_time);
          },
          .code =
              [](const Parameters&) {
                return CodeFragment{"difference", {"CUTOFF"}};
              }};
}

}  // namespace whirl::control
