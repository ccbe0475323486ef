#include <cmath>

#include "parameters.hpp"
#include "whirl/control/laws/lqr.hpp"

namespace whirl::control {
namespace {

const ParameterInfo kHorizon{
    "horizon", "1", "samples ahead in which the limit is seen", 12, 1, BoundedRegulator::kMaxHorizon, 0, 0};

double stiffness(const ControllerDesign& d, double side) { return d.model.k1 + side * d.model.k1_conj.real(); }
double damping(const ControllerDesign& d, double side) { return d.model.c + side * d.model.c_conj.real(); }

/// Of the regulator of the x axis (side 1) or the y axis (-1).
LqrGains gains(const ControllerDesign& d, const Parameters& v, double side) {
  return lqr_gains(stiffness(d, side), damping(d, side), d.sample_time, v.at("position_scale"), v.at("velocity_scale"),
                   v.at("control_scale"));
}

}  // namespace

LawEntry mpc_law() {
  std::vector<ParameterInfo> parameters = quadratic_weights();
  parameters.push_back(kHorizon);
  return {.info = {"mpc", "model predictive control with the force limit",
                   "quadratic program solved exactly in every step; Riccati terminal cost", parameters},
          .equation =
              "     a = w_0 - d,  w minimises sum (w_k + kp x_k + kd v_k)^2 with |w_k - d_k| <= limit over the horizon",
          .latex = equations(
              {R"(a = w_0 - d)", R"(\min_{w} \sum_{k<N} (w_k + k_p x_k + k_d v_k)^2)", R"(|w_k - d_k| \le a_{\max})"}),
          .make = [](const ControllerDesign& d, const Parameters& v) -> AnyLaw {
            const auto axis = [&](double side) {
              const LqrGains g = gains(d, v, side);
              return ModelPredictive{BoundedRegulator(sample_axis(stiffness(d, side), damping(d, side), d.sample_time),
                                                      g.kp, g.kd, static_cast<int>(v.at("horizon"))),
                                     g.kp, g.kd, d.model.gain * d.force_limit, d.sample_time};
            };
            return LateralLaw<ModelPredictive>{axis(1), axis(-1)};
          },
          .code = [](const Parameters&) { return CodeFragment{"mpc"}; },
          .model_free = true,
          .code_parameters =
              [](const ControllerDesign& d, const Parameters& v) {
                // Gains of the regulator per axis, as the library's law has them.
                std::vector<std::pair<ParameterInfo, double>> out;
                for (const auto& [axis, side] : {std::pair("_x", 1.0), std::pair("_y", -1.0)}) {
                  const LqrGains g = gains(d, v, side);
                  for (const auto& [info, gain] : {std::pair(kKp, g.kp), std::pair(kKd, g.kd)}) {
                    out.emplace_back(info, gain).first.name += axis;
                  }
                }
                out.emplace_back(kHorizon, std::floor(v.at("horizon")));
                return out;
              }};
}

}  // namespace whirl::control
