#include "parameters.hpp"

namespace whirl::control {

LawEntry asmc_law() {
  return {
      .info = {"asmc",
               "adaptive-gain sliding mode",
               "Plestan, Shtessel, Bregeault, Poznyak 2010",
               {kSurface,
                {"boundary_layer", "m/s", "eps; default from gain_max as rho", kDerived, 1e-6, 1e3, 0.005, 1,
                 [](const Parameters& v, double h, int n) { return boundary_layer_limit(h, v.at("gain_max"), n); }},
                {"adaptation_rate", "1/s^2", "growth of the gain per |s|", 500, 0, 1e8, 10, 1e5},
                {"dead_zone", "m/s", "mu; default 4 gain_max h", kDerived, 0, 1e3, 0, 0,
                 [](const Parameters& v, double h, int) { return 4 * v.at("gain_max") * h; }},
                {"gain_min", "m/s^2", "smallest gain", 0.1, 0, 1e3, 0, 0},
                {"gain_max", "m/s^2", "largest gain", 10, 1e-3, 1e3, 1, 20}}},
      .equation =
          "     s = v + C x,  a = -f - C v - K tanh(s/eps),  K' = rate |s| sgn(|s| - mu), gain_min <= K <= gain_max\n"
          "   (Plestan, Shtessel, Bregeault, Poznyak 2010)",
      .latex = equations({kLinearLatex, R"(a = -f - C v - K \tanh(s/\varepsilon))",
                          R"(\dot K = \bar K |s|\,\mathrm{sgn}(|s| - \mu))"}),
      .make =
          [](const ControllerDesign& d, const Parameters& v) {
            return both(AdaptiveSmc{v.at("surface_gain"), v.at("boundary_layer"), v.at("adaptation_rate"),
                                    v.at("dead_zone"), v.at("gain_min"), v.at("gain_max"), d.sample_time,
                                    v.at("gain_min")});
          },
      .code =
          [](const Parameters&) {
            return CodeFragment{"asmc", {}, {}, "m/s^2, adaptive gain", "state->params.gain_min"};
          },
      .conditions = {{"gain_min", [](const Parameters& v) { return v.at("gain_min") <= v.at("gain_max"); },
                      "at most gain_max", "p->gain_min <= p->gain_max"}}};
}

}  // namespace whirl::control
