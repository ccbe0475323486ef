#pragma once
#include "whirl/control/estimators/input.hpp"

namespace whirl::control {

/// Linear extended state observer (Gao 2003; discrete current form of Miklosovic, Radke, Gao, ACC 2006), all
/// three poles at exp(-w h). States z, v and the disturbance the model does not explain; in the rotor form
/// that disturbance turns with the rotor (at standstill this is the classical constant one).
class ExtendedStateObserver {
 public:
  ExtendedStateObserver(const LateralModel& model, double bandwidth, double sample_time) noexcept;
  DiskMotion step(const EstimatorInput& in) noexcept;
  void reset() noexcept {
    started_ = false;
    state_ = {};
  }

 private:
  LateralModel model_;
  double h_, l1_, l2_, l3_;
  DiskMotion state_;
  double last_omega_ = 0;
  bool started_ = false;
};

}  // namespace whirl::control
