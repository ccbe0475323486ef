#include "parameters.hpp"

namespace whirl::control {

LawEntry nftsmc_law() {
  return {
      .info = {"nftsmc",
               "nonsingular fast terminal sliding mode",
               "Yang, Yang 2011",
               {kSurface,
                kSwitching,
                kLayer,
                kExponent,
                kLength,
                {"fast_gain", "1", "kappa of the fast term", 0.2, 0, 1e3, 0.02, 5},
                {"fast_exponent", "1", "a1 > 1/r; default 1/r + 0.2", kDerived, 1, 10, 0, 0,
                 [](const Parameters& v, double, int) { return 1 / v.at("exponent") + 0.2; }}}},
      .equation =
          "     s = C [x + kappa L sig(x/L)^a1] + C L sig(v/(C L))^g,  g = 1/r\n"
          "     a = -[f + (C/g) C L sig(v/(C L))^(2-g) (1 + kappa a1 |x/L|^(a1-1)) + rho tanh(s/eps)]\n"
          "   (Yang, Yang 2011)",
      .latex = equations(
          {R"(s = C \left[x + \kappa L\,\mathrm{sig}(x/L)^{a_1}\right] + C L\,\mathrm{sig}\left(\frac{v}{CL}\right)^{g})",
           R"(a = -\left[f + \frac{C}{g} C L\,\mathrm{sig}\left(\frac{v}{CL}\right)^{2-g} \left(1 + \kappa a_1 |x/L|^{a_1-1}\right) + \rho \tanh(s/\varepsilon)\right])"}),
      .make =
          [](const ControllerDesign&, const Parameters& v) {
            return both(NonsingularFastTerminalSmc{v.at("surface_gain"), v.at("switching_gain"), v.at("boundary_layer"),
                                                   v.at("exponent"), v.at("length_scale"), v.at("fast_gain"),
                                                   v.at("fast_exponent")});
          },
      .code = [](const Parameters&) { return CodeFragment{"nftsmc"}; },
      .conditions = {{"fast_exponent", [](const Parameters& v) { return v.at("fast_exponent") > 1 / v.at("exponent"); },
                      "above 1/exponent", "(p->fast_exponent * p->exponent) > R(1.0)"}}};
}

}  // namespace whirl::control
