#pragma once
#include <array>
#include <optional>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/core/finding.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::tuning {

/// The paper's argument that a sliding surface is reached (eqs. 28 to 42), along one run.
///
/// For laws with S = v + phi(x) and a reaching term -rho tanh(S/eps), per axis (eq. 37 with eq. 43)
///
///   dS/dt = Delta - rho tanh(S/eps),   V = S^T S / 2,   dV/dt = S_x dS_x/dt + S_y dS_y/dt,
///
/// with S as the law computes it. Delta is all that is not the reaching term: model errors, delay, estimator, limits of
/// the force. It is found from S itself, its slope taken over 11 ticks. Where max |Delta| < rho (eq. 42), take kappa
/// half of what is left, (rho - max |Delta|) / 2: with tanh in the place of sgn, dV/dt <= -kappa (|S_x| + |S_y|) (eqs.
/// 29 and 39) outside the layer |S| <= eps atanh((max |Delta| + kappa) / rho), which is reached within |S(0)| / kappa.
struct SlidingStudy {
  std::vector<double> time;                           ///< s
  std::vector<double> v, v_rate;                      ///< V, m^2/s^2, and dV/dt, m^2/s^3
  std::array<std::vector<double>, 2> s, disturbance;  ///< S, m/s, and Delta, m/s^2, of x and y
  std::vector<double> bound;                          ///< -kappa (|S_x| + |S_y|), m^2/s^3; 0 where kappa is not above 0
  double skip = 0;                                    ///< start that is not judged, s
  double switching_gain = 0;                          ///< rho, m/s^2
  double largest_disturbance = 0;                     ///< of either axis after `skip`, m/s^2
  double share_above = 0;                             ///< of the ticks after `skip`, with |Delta| >= rho on an axis
  double share_outside = 0;                           ///< with |S| above its layer and dV/dt above `bound`
  double layer = 0;                                   ///< bound of |S| that the layer leaves, m/s; infinite: none
  double reach_bound = 0;                             ///< |S(0)| / kappa, s; infinite where kappa is not above 0
  double reached = 0;  ///< first time from which |S| stays in the layer, s; infinite: never

  /// The surface is reached within its bound, to the tick at which S is read.
  bool reached_in_time() const;

  /// sliding_bound_missed (unusable) where rho is not above the disturbance; nothing: the argument holds on this run.
  std::optional<Finding> missed() const;
};

/// Nothing for laws without such a surface and reaching term. `log`: of ClosedLoopPlant::run; `skip`, s: start
/// transient of the estimator.
std::optional<SlidingStudy> sliding_study(const ControllerDesign& design, const Recording& log, double skip = 0.5);

}  // namespace whirl::tuning
