#include <fmt/format.h>

#include <cmath>

#include "whirl/control/controller.hpp"
#include "whirl/control/method.hpp"
#include "whirl/core/error.hpp"

namespace whirl::control {
namespace {

Runout make_runout(const Parameters& v) {
  Runout r;
  for (std::size_t k = 0; k < Runout::kHarmonics; ++k) {
    r.x_cos[k] = v.at(fmt::format("runout_x_cos_{}", k + 1));
    r.x_sin[k] = v.at(fmt::format("runout_x_sin_{}", k + 1));
    r.y_cos[k] = v.at(fmt::format("runout_y_cos_{}", k + 1));
    r.y_sin[k] = v.at(fmt::format("runout_y_sin_{}", k + 1));
  }
  return r;
}

std::array<StructureMode, Structure::kModes> make_structure(const Parameters& v) {
  std::array<StructureMode, Structure::kModes> out;
  for (std::size_t k = 0; k < out.size(); ++k) {
    const auto at = [&](const char* name) { return v.at(fmt::format("mode_{}_{}", k + 1, name)); };
    out[k] = {at("omega"), at("damping"), at("share")};
  }
  return out;
}

/// 0 without supervision, which says when nothing may be learned.
Reidentify reidentify_mode(const ControllerDesign& d, const Parameters& v) {
  const auto mode = static_cast<Reidentify>(std::lround(v.at("reidentify")));
  if (mode == Reidentify::off) return mode;
  if (!(d.model.k1 > 0 && d.model.c > 0)) {
    throw Error::in_field("reidentify", fmt::format("model with k1 {:g} 1/s^2, c {:g} 1/s", d.model.k1, d.model.c),
                          "0: stiffness and damping are counted in shares of the model's, which must be positive");
  }
  if (mode == Reidentify::acts && estimator_entry(d.estimator).finds_disturbance) {
    throw Error::in_field("reidentify", fmt::format("2 with estimator {}", d.estimator),
                          "0 or 1: the force that this estimator finds has the gain of the actuators in it already");
  }
  return v.at("supervise") > 0 ? mode : Reidentify::off;
}

}  // namespace

Controller make_controller(const ControllerDesign& design) {
  const Parameters v = resolve_parameters(design);
  const RotorModel& m = design.model;
  if (!(m.gain > 0) || !std::isfinite(m.gain)) {
    throw Error::in_field(
        "model.gain", fmt::format("{:g} 1/kg", m.gain),
        "positive and finite: the acceleration per newton of actuator force is needed (weigh the rotor "
        "or fit the gain from a record with control)");
  }
  if (!std::isfinite(m.k1 + m.k2 + m.c + std::abs(m.k1_conj) + std::abs(m.c_conj) + std::abs(m.eps) +
                     std::abs(m.offset))) {
    throw Error("model of the controller: a coefficient is not finite");
  }
  require_range("force_limit", design.force_limit, 0, 1e9, "N");

  ControllerSettings s;
  s.model = LateralModel::from(m);
  s.eps = m.eps;
  s.offset = m.offset;
  s.gain = m.gain;
  s.timing.step = design.sample_time;
  s.timing.delay = design.delay;
  s.timing.sensor = v.at("sensor_delay");
  s.force.largest = design.force_limit;
  s.force.slew = v.at("slew_limit");
  s.force.hysteresis = v.at("hysteresis");
  s.cancel = v.at("cancel");
  s.feedforward.on = design.feedforward;
  s.feedforward.advance = v.at("advance") > 0;
  s.predict = v.at("predict") > 0;
  s.stale_limit = static_cast<long>(v.at("stale_limit"));
  SampleGate gate;
  gate.range = v.at("sensor_range");
  gate.jump = v.at("jump_limit");
  s.supervise = v.at("supervise") > 0;
  s.reidentify = reidentify_mode(design, v);
  s.feedforward.carried = !s.feedforward.on && !law_entry(design.law).cancels_synchronous;
  const Supervisor supervisor({s.model, s.eps, s.timing.step, v.at("watch_level"), v.at("watch_bandwidth"),
                               s.feedforward.on && !estimator_entry(design.estimator).finds_disturbance,
                               s.feedforward.carried, s.timing.delay, s.gain * s.force.largest, s.gain * s.force.slew,
                               s.gain * s.force.hysteresis});
  return Controller(s, estimator_entry(design.estimator).make(design, v), law_entry(design.law).make(design, v), gate,
                    make_runout(v), supervisor, make_structure(v),
                    Reidentifier({s.model,
                                  s.eps,
                                  s.timing.step,
                                  {v.at("reidentify_stiffness"), v.at("reidentify_damping"), v.at("reidentify_gain")},
                                  s.reidentify == Reidentify::acts}));
}

}  // namespace whirl::control
