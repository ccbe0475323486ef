#include "parameters.hpp"

namespace whirl::control {

LawEntry lsmc_law() {
  return {.info = {"lsmc", "linear sliding mode", "s = v + C x", {kSurface, kSwitching, kLayer}},
          .equation = "     s = v + C x,  a = -[f + C v + rho tanh(s/eps)]",
          .latex = equations({kLinearLatex, R"(a = -\left[f + C v + \rho \tanh(s/\varepsilon)\right])"}),
          .make =
              [](const ControllerDesign&, const Parameters& v) {
                return both(LinearSmc{v.at("surface_gain"), v.at("switching_gain"), v.at("boundary_layer")});
              },
          .code = [](const Parameters&) { return CodeFragment{"lsmc"}; }};
}

}  // namespace whirl::control
