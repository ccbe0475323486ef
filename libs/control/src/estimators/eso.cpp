#include "whirl/control/estimators/eso.hpp"

#include "whirl/control/method.hpp"

namespace whirl::control {

ExtendedStateObserver::ExtendedStateObserver(const LateralModel& model, double bandwidth, double sample_time) noexcept
    : model_(model), h_(sample_time) {
  const double lam = std::exp(-bandwidth * h_);
  l1_ = 1 - lam * lam * lam;
  l2_ = 3 * (1 - lam) * (1 - lam) * (1 + lam) / (2 * h_);
  l3_ = (1 - lam) * (1 - lam) * (1 - lam) / (h_ * h_);
}

DiskMotion ExtendedStateObserver::step(const EstimatorInput& in) noexcept {
  if (!started_) {
    state_ = {in.z, product({0, in.omega}, in.z), in.d};
    started_ = true;
    return state_;
  }
  state_ = predict_interval(model_, state_, in, h_);
  if (in.fresh) {
    const std::complex<double> e = in.z - state_.z;
    state_.z += l1_ * e;
    state_.v += l2_ * e;
    state_.d += l3_ * e;
  }
  return state_;
}

EstimatorEntry eso_estimator() {
  return {.info = {"eso",
                   "linear extended state observer in rotor form",
                   "Gao 2003; Miklosovic, Radke, Gao 2006",
                   {{"bandwidth", "1/s", "observer poles", 300, 1, 1e4, 50, 1200}}},
          .make = [](const ControllerDesign& d, const Parameters& v) -> AnyEstimator {
            return ExtendedStateObserver(LateralModel::from(d.model), v.at("bandwidth"), d.sample_time);
          },
          .code = [](const Parameters&) { return CodeFragment{"eso"}; },
          .model_based = true,
          .finds_disturbance = true};
}

}  // namespace whirl::control
