#include "parameters.hpp"

namespace whirl::control {

LawEntry smc_implicit_law() {
  return {.info = {"smc_implicit",
                   "linear sliding mode, implicit",
                   "Acary, Brogliato, Orlov 2012",
                   {kSurface, kSwitching, kTau}},
          .equation = "     s = v + C x,  a = -f - C v - clamp(s/tau, -rho, rho)   (Acary, Brogliato, Orlov 2012)",
          .latex = equations({kLinearLatex, R"(a = -f - C v - \mathrm{clamp}(s/\tau, -\rho, \rho))"}),
          .make =
              [](const ControllerDesign&, const Parameters& v) {
                return both(ImplicitSmc{v.at("surface_gain"), v.at("switching_gain"), v.at("tau")});
              },
          .code = [](const Parameters&) { return CodeFragment{"smc_implicit"}; }};
}

}  // namespace whirl::control
