#include "parameters.hpp"

namespace whirl::control {

LawEntry tsmc_implicit_law() {
  return {.info = {"tsmc_implicit",
                   "terminal sliding mode, implicit set-point",
                   "backward Euler on the surface",
                   {kSurface, kSwitching, kTau, kExponent, kLength}},
          .equation = "     z + h C phi(z) = x,  s = v - (z - x)/h,  a = -f + clamp(-s/tau, -rho, rho)",
          .latex = equations({R"(z + h C \varphi(z) = x)", R"(s = v - (z - x)/h)",
                              R"(a = -f - \mathrm{clamp}(s/\tau, -\rho, \rho))", kPhiLatex}),
          .make =
              [](const ControllerDesign& d, const Parameters& v) {
                return both(ImplicitTerminalSmc{v.at("surface_gain"), v.at("switching_gain"), v.at("tau"),
                                                v.at("exponent"), v.at("length_scale"), d.sample_time});
              },
          .code = [](const Parameters&) { return CodeFragment{"tsmc_implicit"}; }};
}

}  // namespace whirl::control
