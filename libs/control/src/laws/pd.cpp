#include "parameters.hpp"

namespace whirl::control {

LawEntry pd_law() {
  return {.info = {"pd", "proportional-derivative", "paper section VII-B", {kKp, kKd}},
          .equation = kPdText,
          .latex = kPdLatex,
          .make =
              [](const ControllerDesign&, const Parameters& v) {
                return both(Pd{v.at("kp"), v.at("kd")});
              },
          .code = [](const Parameters&) { return CodeFragment{"pd"}; },
          .model_free = true};
}

}  // namespace whirl::control
