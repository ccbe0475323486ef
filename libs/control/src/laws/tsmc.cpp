#include "parameters.hpp"

namespace whirl::control {
namespace {

const char* const kText =
    "     s = v + C phi(x),  a = -[f + C phi'(x) v + rho tanh(s/eps)],  phi(x) = L sig(x/L)^r\n"
    "   (Piramoon, Ayoubi, Bashash 2024, eqs. 27 and 43)";

std::string latex() {
  return equations(
      {R"(s = v + C \varphi(x))", R"(a = -\left[f + C \varphi'(x) v + \rho \tanh(s/\varepsilon)\right])", kPhiLatex});
}

AnyLaw make(const Parameters& v, Regularisation regularisation) {
  return both(
      TerminalSmc{v.at("surface_gain"), v.at("switching_gain"), v.at("boundary_layer"), power_of(v, regularisation)});
}

}  // namespace

LawEntry tsmc_law() {
  return {.info = {"tsmc",
                   "terminal sliding mode, regularised",
                   "paper eq. 43; singular term blended, layer from the loop delay",
                   {kSurface, kSwitching, kLayer, kExponent, kDelta, kLength}},
          .equation = kText,
          .latex = latex(),
          .make = [](const ControllerDesign&, const Parameters& v) { return make(v, Regularisation::blend); },
          .code =
              [](const Parameters&) {
                return CodeFragment{"tsmc", {"POWER", "BLEND"}, {{"regularised", kBlended}}};
              }};
}

LawEntry tsmc_paper_law() {
  ParameterInfo delta = kDelta;
  delta.meaning = "regularisation length; 0: the singular term as printed";
  delta.fallback = 0;
  delta.low = delta.tune_low = delta.tune_high = 0;
  return {.info = {"tsmc_paper",
                   "terminal sliding mode as printed (eq. 43)",
                   "paper eqs. 27, 35, 36, 43",
                   {kSurface, kSwitching, kLayer, kExponent, delta, kLength}},
          .equation = kText,
          .latex = latex(),
          // Printed, or with the clamp when a delta is given.
          .make =
              [](const ControllerDesign&, const Parameters& v) {
                return make(v, v.at("delta") > 0 ? Regularisation::clamp : Regularisation::none);
              },
          .code =
              [](const Parameters& v) {
                CodeFragment code{"tsmc", {"POWER"}};
                if (v.at("delta") > 0) {
                  code.features.insert("CLAMP");
                  code.slots["regularised"] = " taken at |x| >= delta";
                }
                return code;
              },
          .design_values = {{"delta", 30e-6}}};  // the printed term is singular: a clamp is mandatory
}

}  // namespace whirl::control
