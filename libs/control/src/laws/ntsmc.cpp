#include "parameters.hpp"

namespace whirl::control {

LawEntry ntsmc_law() {
  return {
      .info = {"ntsmc",
               "nonsingular terminal sliding mode",
               "Feng, Yu, Man 2002",
               {kSurface, kSwitching, kLayer, kExponent, kLength}},
      .equation =
          "     s = C x + C L sig(v/(C L))^g,  a = -[f + (C/g) C L sig(v/(C L))^(2-g) + rho tanh(s/eps)],  g = 1/r\n"
          "   (Feng, Yu, Man 2002)",
      .latex = equations(
          {R"(s = C x + C L\,\mathrm{sig}\left(\frac{v}{CL}\right)^{g})",
           R"(a = -\left[f + \frac{C}{g} C L\,\mathrm{sig}\left(\frac{v}{CL}\right)^{2-g} + \rho \tanh(s/\varepsilon)\right])",
           R"(g = 1/r)"}),
      .make =
          [](const ControllerDesign&, const Parameters& v) {
            return both(NonsingularTerminalSmc{v.at("surface_gain"), v.at("switching_gain"), v.at("boundary_layer"),
                                               v.at("exponent"), v.at("length_scale")});
          },
      .code = [](const Parameters&) { return CodeFragment{"ntsmc"}; }};
}

}  // namespace whirl::control
