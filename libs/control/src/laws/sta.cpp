#include "parameters.hpp"

namespace whirl::control {
namespace {

const ParameterInfo kSuperTwistingRate{
    "twisting_rate", "m/s^3", "L, bound of the rate of the disturbance", 100, 1e-3, 1e6, 2, 2000};
const ParameterInfo kLimit{"twisting_limit", "m/s^2", "bound of the integral part", 10, 1e-3, 1e3, 0, 0};
const char* const kMemory = "m/s^2, integral part of the twisting law";

AnyLaw make(const ControllerDesign& d, const Parameters& v, bool implicit) {
  return both(
      SuperTwistingSmc{v.at("surface_gain"), {v.at("twisting_rate"), v.at("twisting_limit")}, d.sample_time, implicit});
}

}  // namespace

LawEntry sta_law() {
  return {.info = {"sta",
                   "super-twisting, explicit",
                   "Levant 1998; Moreno, Osorio 2012",
                   {kSurface, kSuperTwistingRate, kLimit}},
          .equation =
              "     s = v + C x,  a = -f - C v - k1 sig(s)^(1/2) + w,  w' = -k2 sgn(s),  k1 = 1.5 sqrt(L), k2 = 1.1 L\n"
              "   (Levant 1998; Moreno, Osorio 2012)",
          .latex = equations(
              {kLinearLatex, R"(a = -f - C v - k_1\,\mathrm{sig}(s)^{1/2} + w)", R"(\dot w = -k_2\,\mathrm{sgn}(s))"}),
          .make = [](const ControllerDesign& d, const Parameters& v) { return make(d, v, false); },
          .code =
              [](const Parameters&) {
                return CodeFragment{"sta", {}, {}, kMemory};
              }};
}

LawEntry sta_implicit_law() {
  return {.info = {"sta_implicit",
                   "super-twisting, implicit",
                   "Brogliato, Polyakov, Efimov 2020",
                   {kSurface, kSuperTwistingRate, kLimit}},
          .equation =
              "     s = v + C x,  a = -f - C v - k1 sig(s)^(1/2) + w,  w' = -k2 sgn(s): backward Euler solved exactly\n"
              "   (Brogliato, Polyakov, Efimov 2020)",
          .latex = equations({kLinearLatex, R"(a = -f - C v - k_1\,\mathrm{sig}(s^+)^{1/2} + w^+)",
                              R"(w^+ = w - h k_2\,\mathrm{sgn}(s^+))"}),
          .make = [](const ControllerDesign& d, const Parameters& v) { return make(d, v, true); },
          .code =
              [](const Parameters&) {
                return CodeFragment{"sta", {"IMPLICIT"}, {}, kMemory};
              }};
}

}  // namespace whirl::control
