#include "parameters.hpp"

namespace whirl::control {

LawEntry bsmc_law() {
  return {.info = {"bsmc",
                   "barrier-function sliding mode",
                   "Obeid, Fridman, Laghrouche, Harmouche 2018",
                   {kSurface,
                    {"barrier_width", "m/s", "e: |s| is kept below", 0.1, 1e-6, 1e3, 0.01, 1},
                    {"barrier_gain", "m/s^2", "K0", 1, 1e-6, 1e3, 0.05, 20},
                    {"gain_max", "m/s^2", "largest gain", 10, 1e-3, 1e3, 0, 0}}},
          .equation =
              "     s = v + C x,  a = -f - C v - K sgn(s),  K = K0 |s|/(e - |s|), at most gain_max\n"
              "   (Obeid, Fridman, Laghrouche, Harmouche 2018)",
          .latex = equations({kLinearLatex, R"(a = -f - C v - K\,\mathrm{sgn}(s))",
                              R"(K = \min\left(\frac{K_0 |s|}{e - |s|}, K_{\max}\right))"}),
          .make =
              [](const ControllerDesign&, const Parameters& v) {
                return both(
                    BarrierSmc{v.at("surface_gain"), v.at("barrier_width"), v.at("barrier_gain"), v.at("gain_max")});
              },
          .code = [](const Parameters&) { return CodeFragment{"bsmc"}; }};
}

}  // namespace whirl::control
