#pragma once
#include "whirl/control/estimators/input.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// One axis of Levant's robust exact differentiator of order 1: converges in finite time when |y''| <= L.
///   x_e' = w - k1 sig(x_e - y)^(1/2),  w' = -k2 sgn(x_e - y),  k1 = 1.5 sqrt(L),  k2 = 1.1 L;  w is the
///   derivative.
struct RobustDifferentiator {
  double rate = 100;  ///< L, m/s^2
  double x = 0, w = 0;

  double explicit_step(double y, double h) noexcept;  ///< forward Euler: chatters by O(L h)
  double implicit_step(double y, double h) noexcept;  ///< backward Euler solved exactly: no chatter
};

class LevantDifferentiator {
 public:
  LevantDifferentiator(double rate, double sample_time, bool implicit) noexcept;
  DiskMotion step(const EstimatorInput& in) noexcept;
  void reset() noexcept;

 private:
  RobustDifferentiator x_, y_;
  double h_;
  bool implicit_, started_ = false;
};

}  // namespace whirl::control
