#pragma once
#include <array>
#include <cstdint>

#include "whirl/control/laws/axis.hpp"

namespace whirl::control {

/// One axis x'' = -k1 x - c x' + w sampled with the input held over h: x+ = a x + b w, x = (m, m/s), w in m/s^2.
struct SampledAxis {
  double a00 = 1, a01 = 0, a10 = 0, a11 = 1, b0 = 0, b1 = 0;
};
SampledAxis sample_axis(double k1, double c, double sample_time);

/// The linear-quadratic regulator w = -kp x - kd v with limits on the input, solved exactly over a horizon:
///   minimise  sum_{k<N} (x_k'Q x_k + r w_k^2) + x_N'P x_N,  x_{k+1} = A x_k + b w_k,  low_k <= w_k <= high_k,
/// P the solution of the discrete Riccati equation, so that the horizon is infinite in effect. With K = (kp, kd) the
/// cost is (r + b'Pb) sum (w_k + K x_k)^2 plus a constant (completion of squares): Q, r and P are needed for K only.
///
/// A box-constrained quadratic program with N unknowns. For a given set of inputs at their limits a Riccati recursion
/// over the two states solves it in O(N). The set is found by exchanging all wrong members at once (Kunisch, Rendl,
/// SIAM J. Optim. 2003) and, when that makes no progress, by a primal active-set method, whose cost falls in every step
/// (Nocedal, Wright, Numerical Optimization, 16.5). Fixed size, no allocation, bounded iterations, and a residual of
/// the optimality conditions computed apart from the recursion.
class BoundedRegulator {
 public:
  static constexpr int kMaxHorizon = 32;
  static constexpr int kMaxIterations = 200;
  using Inputs = std::array<double, kMaxHorizon>;
  enum class Bound : std::int8_t { low = -1, none = 0, high = 1 };
  using Bounds = std::array<Bound, kMaxHorizon>;

  struct Solution {
    Inputs w;             ///< m/s^2; only the first `horizon` entries are set
    int iterations = 0;   ///< sets tried
    double residual = 0;  ///< largest |w_k - clamp(w_k - gradient_k, low_k, high_k)|, m/s^2; 0 at the optimum
    bool solved = false;  ///< the set fulfils the optimality conditions; false: kMaxIterations were not enough
  };

  BoundedRegulator() = default;
  BoundedRegulator(const SampledAxis& plant, double kp, double kd, int horizon) noexcept;

  /// `set`: the first guess which inputs are at a limit, replaced by the answer. Infinite limits are none.
  Solution solve(double x, double v, const Inputs& low, const Inputs& high, Bounds& set) const noexcept;
  int horizon() const noexcept { return horizon_; }

 private:
  void trajectory(double x, double v, const Inputs& low, const Inputs& high, const Bounds& set, Inputs& w,
                  Inputs& gradient) const noexcept;

  SampledAxis plant_;
  double kp_ = 0, kd_ = 0;
  int horizon_ = 1;
  Inputs row_x_{}, row_v_{};  ///< without limits w_k = row_x_k x + row_v_k v
};

/// Model predictive control of one axis on the identified model with the limit of the actuator. The disturbance d acts
/// where the control does and turns with the rotor, so that w_k = a_k + d_k is what is left to choose and its limits
/// move along the horizon:
///   a = w_0 - d,   |a_k| <= limit,   d_k = d cos(k h omega) + d_quarter sin(k h omega).
/// Away from the limit this is the linear-quadratic regulator with feedforward.
struct ModelPredictive {
  BoundedRegulator regulator;
  double kp = 0, kd = 0;  ///< of the regulator
  double limit = 0;       ///< of a, m/s^2; 0 = none
  double sample_time = 1e-3;
  BoundedRegulator::Bounds set{};  ///< state: the last answer, the next first guess
  double residual = 0;             ///< of the last step, m/s^2
  int iterations = 0;              ///< of the last step

  AxisOutput step(const AxisInput& in) noexcept;
  void reset() noexcept { set.fill(BoundedRegulator::Bound::none); }
};

}  // namespace whirl::control
