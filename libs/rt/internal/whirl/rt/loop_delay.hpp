#pragma once
#include <Eigen/Core>

namespace whirl::rt {

/// Random telegraph signal of a given amplitude: holds for 8 to 40 periods of the loop, then perhaps turns its sign.
/// Seeded.
Eigen::VectorXd telegraph(double amplitude, long samples, unsigned seed);

/// Time from a force asked for to its effect in the displacement read back.
struct LoopDelay {
  double delay = 0;      ///< s, the hold of the force over a period not counted
  double deviation = 0;  ///< standard deviation of `delay`, from its scatter over parts of the record, s
  double gain = 0;       ///< acceleration per newton, 1/kg; negative: the force acts the other way round
  double frequency = 0;  ///< of the free vibration, Hz
  double explained = 0;  ///< fraction that the force explains of what the motion alone leaves open, 0 to 1
};

/// Loop delay of one axis of a shaft at rest, from the force asked for in each period (sent after the reading of the
/// same row) and the displacement read.
///
/// Model x'' + c x' + k x = b u(t - d) + g with the force held over each period. In the weak form with test functions
/// phi = (s^2 - (t - t0)^2)^4 of half width s = 25 periods,
///
///     int x phi'' - c int x phi' + k int x phi - g int phi = b int u(t - d) phi,
///
/// every integral of x by sums, that of u exactly; for each d least squares gives c, k, b and g, and the d of the least
/// residual is taken (0 to 20 periods). A lag of the actuator counts as delay. Needs no velocity and averages the noise
/// of the displacement. Weak forms: Schaeffer and McCalla, Phys. Rev. E 96 (2017) 023302.
///
/// Throws Error for records shorter than 400 periods or of different length.
LoopDelay loop_delay(const Eigen::Ref<const Eigen::VectorXd>& force,
                     const Eigen::Ref<const Eigen::VectorXd>& displacement, double sample_time);

}  // namespace whirl::rt
