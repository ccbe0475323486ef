#pragma once
#include <Eigen/Core>
#include <atomic>
#include <complex>
#include <cstdint>
#include <memory>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/tuning/loop_margins.hpp"

namespace whirl::tuning {

/// The controller's force in one window, N, and whether its motion grew or stood beside the synchronous one.
struct ForceRun {
  Eigen::VectorXcd force;
  bool holds = true;
};

/// One run of the loop on a rig at constant speed: `window` samples at its end are kept, `excitation` (N, one period of
/// the window) is added to the force. Motion stands when in the second half of the window what is left of the readings
/// without offset, forward and backward 1x (least squares) is above the judge's limits and not below 0.6 of what is
/// left in the first half.
ForceRun run_window(const ControllerDesign& design, const std::shared_ptr<const rig::RigTables>& tables,
                    std::uint64_t seed, Eigen::Index window, const Eigen::VectorXcd* excitation);

/// The rig at a constant speed, its forces without limit and resolution, its structure at rest.
rig::RigParameters at_constant_speed(rig::RigParameters p, double omega, double duration);

/// How far gain and delay are tried at the speeds of one loop, of which only the worst counts: to the least that was
/// found at another speed, but always as far as VerdictLimits asks.
class Reach {
 public:
  Reach();
  double gain() const { return gain_; }
  double delay(double sample_time) const;
  void found(const LoopMargins& m);

 private:
  std::atomic<double> gain_, delay_;
};

/// The loop with another gain and further delay, left alone at a constant speed.
class TriedLoop {
 public:
  TriedLoop(const ControllerDesign& design, const rig::RigParameters& rig, double omega, const MarginOptions& o,
            std::uint64_t seed);

  /// Puts what the running loop shows in the place of margins that it contradicts. `follows`: the gain of the law
  /// follows the motion, so that nothing but the running loop tells. Growth near the limit is slow: that a loop still
  /// holds outside its linear margins is no contradiction.
  /// `reach`: what is not found within it is infinite; null: tried as far as any is.
  void verify(LoopMargins& m, bool follows, const Reach* reach = nullptr) const;

 private:
  bool holds(double gain, int delay) const;
  double gain(double most) const;
  double delay(double most) const;

  const ControllerDesign& design_;
  rig::RigParameters rig_;
  const MarginOptions& options_;
  std::uint64_t seed_;
};

/// loop_margins where only the worst over the speeds and margin_failure are asked for: they are the same, what a single
/// speed has beyond is not looked for.
std::vector<SpeedMargins> worst_loop_margins(const ControllerDesign& design, const rig::RigParameters& rig,
                                             const MarginOptions& options);

}  // namespace whirl::tuning
