#include "parameters.hpp"

namespace whirl::control {

LawEntry ftsmc_law() {
  return {.info = {"ftsmc",
                   "fast terminal sliding mode",
                   "Yu, Man 2002",
                   {{"linear_gain", "1/s", "alpha of the linear part", 30, 0, 5000, 2, 300},
                    kSurface,
                    kSwitching,
                    kLayer,
                    kExponent,
                    kDelta,
                    kLength}},
          .equation =
              "     s = v + alpha x + C phi(x),  a = -[f + (alpha + C phi'(x)) v + rho tanh(s/eps)]\n"
              "   (Yu, Man 2002)",
          .latex =
              equations({R"(s = v + \alpha x + C \varphi(x))",
                         R"(a = -\left[f + (\alpha + C \varphi'(x)) v + \rho \tanh(s/\varepsilon)\right])", kPhiLatex}),
          .make =
              [](const ControllerDesign&, const Parameters& v) {
                return both(FastTerminalSmc{v.at("linear_gain"), v.at("surface_gain"), v.at("switching_gain"),
                                            v.at("boundary_layer"), power_of(v, Regularisation::blend)});
              },
          .code =
              [](const Parameters&) {
                return CodeFragment{"ftsmc", {"POWER", "BLEND"}, {{"regularised", kBlended}}};
              }};
}

}  // namespace whirl::control
