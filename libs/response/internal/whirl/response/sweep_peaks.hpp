#pragma once
#include <Eigen/Core>
#include <functional>

#include "whirl/response/continuation.hpp"

namespace whirl::response {

/// Largest |q| or radius of an answer: what a curve is judged by.
using Amplitude = std::function<double(const PeriodicSolution&)>;

/// Largest amplitude that a very slow sweep over the curve meets, upwards and downwards: along stable answers, and at a
/// fold over to the other stable answer there (the larger, where there are two).
struct SweepPeak {
  double up = 0, down = 0;
  bool jumps = false;  ///< a sweep leaves its branch at a fold
};
/// `others`: answers beside the curve (other_branches); a sweep downwards begins at the smallest stable answer.
SweepPeak sweep_peak(const ResponseCurve& curve, const Amplitude& amplitude,
                     const std::vector<ResponseCurve>& others = {});

/// The same over the size of the forcing.
struct PeakCurve {
  Eigen::VectorXd force;     ///< factor of the unbalance or amplitude of the input
  Eigen::VectorXd up, down;  ///< amplitude met by slow sweeps
  Eigen::VectorXd largest;   ///< of all answers on the curve, stable or not
  double jump_from = 0;      ///< smallest force at which a sweep jumps; NaN: none
  Summary summary;           ///< warning where a curve could not be followed
};
/// `force` ascending, > 0; rotors need Forcing::free_unbalance.
PeakCurve peak_over_force(const PeriodicSystem& system, const Eigen::VectorXd& force, const CurveOptions& options,
                          const Amplitude& amplitude);

}  // namespace whirl::response
