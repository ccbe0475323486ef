#pragma once
#include <array>
#include <cmath>
#include <complex>

#include "whirl/control/laws/axis.hpp"

namespace whirl::control {

/// Feedback of the learned policy, one axis: PD and a layer of three tanh units without bias, odd in (x, v), so that
/// the two directions of an axis are alike and rest stays at rest:
///   a = -kp x - kd v - A sum_i w_i tanh(p_i x/L + q_i v/V) - d.
/// L, V, A: scales of the machine, so that the weights are pure numbers.
struct LearnedFeedback {
  static constexpr int kUnits = 3;
  using Weights = std::array<double, kUnits>;
  double kp = 0, kd = 60;                                ///< 1/s^2, 1/s
  double position = 1e-4, velocity = 1e-2;               ///< L m, V m/s
  double acceleration = 1;                               ///< A, m/s^2
  Weights from_position{}, from_velocity{}, to_force{};  ///< p, q, w

  AxisOutput step(const AxisInput& in) noexcept {
    double sum = 0;
    for (std::size_t i = 0; i < kUnits; ++i)
      sum += to_force[i] * std::tanh(from_position[i] * in.x / position + from_velocity[i] * in.v / velocity);
    return {-kp * in.x - kd * in.v - acceleration * sum - in.d, 0};
  }
  void reset() noexcept {}
};

/// Its answer to what turns with the rotor: an eccentricity q adapted from the displacement z in the rotor's frame,
/// with a complex gain that a layer of three tanh units of the speed gives (pd_notch takes it from the model):
///   q' = -mu m(s) z e^{-i beta},  m = g_0 + sum_i g_i tanh(a_i s + b_i),  s = |omega| / W,  a = q F(beta at effect),
/// conj(m) for a rotor that turns backwards.
class LearnedSynchronous {
 public:
  static constexpr int kUnits = LearnedFeedback::kUnits;
  struct Weights {
    std::array<double, kUnits> slope{}, bias{};                        ///< a, b
    std::array<std::complex<double>, kUnits + 1> gain{};               ///< g
    double rate = 3, speed = 100, speed_min = 10, sample_time = 1e-3;  ///< mu 1/s, W rad/s, rad/s, s
  };
  LearnedSynchronous() = default;
  explicit LearnedSynchronous(const Weights& weights) noexcept : w_(weights) {}

  /// z, beta at the time of the sample; `forcing` = F at the time of effect. `adapt` false: sample lost or
  /// force at its limit.
  std::complex<double> step(std::complex<double> z, double beta, double omega, std::complex<double> forcing,
                            bool adapt) noexcept;
  void reset() noexcept { q_ = {}; }

 private:
  Weights w_;
  std::complex<double> q_;
};

/// A policy whose weights are found by trial on random machines (`whirl design --law learned`), not derived.
struct LearnedPolicy {
  LearnedFeedback x, y;
  LearnedSynchronous synchronous;
};

}  // namespace whirl::control
