#include "parameters.hpp"

namespace whirl::control {
namespace {

const ParameterInfo kPerTurn{"adaptation", "1", "mu, part of the correction made per turn", 0.3, 0, 2, 0.02, 1};

template <SynchronousCanceller::Method kMethod>
LawEntry synchronous(const char* name, const char* title, const char* source, const ParameterInfo& rate,
                     const std::string& text, const char* update) {
  return {.info = {name, title, source, {kKp, kKd, rate, kSlow}},
          .equation = std::string(kPdText) + ", and the canceller of the synchronous motion below: " + text,
          .latex = equations(
              {R"(a = -k_p z - k_d \dot z - d + q F)", update,
               R"(G = \frac{\omega^2}{k_1 - \omega^2 + i \omega c + (k_p + i \omega k_d) e^{-i\omega\tau}})"}),
          .make = [](const ControllerDesign& d, const Parameters& v) -> AnyLaw {
            const double h = d.sample_time, delay = v.at("predict") > 0 ? 0 : d.delay + 0.5 * h;
            const Pd pd{v.at("kp"), v.at("kd")};
            return SynchronousPd{pd, pd,
                                 SynchronousCanceller(kMethod, v.at("adaptation"), pd.kp, pd.kd,
                                                      LateralModel::from(d.model), delay, h, v.at("speed_min"))};
          },
          .model_free = true,
          .cancels_synchronous = true};
}

}  // namespace

LawEntry pd_influence_law() {
  LawEntry e = synchronous<SynchronousCanceller::Method::influence>(
      "pd_influence", "PD with 1x influence coefficients", "once per turn", kPerTurn,
      "influence coefficients, once per turn", R"(q \leftarrow q - \mu \bar X / G)");
  e.code = [](const Parameters&) { return CodeFragment{"pd_synchronous", {"INFLUENCE"}, {{"angle", ", continuous"}}}; };
  e.continuous_angle = true;
  return e;
}

LawEntry pd_fxlms_law() {
  LawEntry e = synchronous<SynchronousCanceller::Method::fxlms>("pd_fxlms", "PD with filtered-x LMS at 1x",
                                                                "quadrature form", kPerTime, "filtered-x LMS",
                                                                R"(q \leftarrow q - h \mu G^{*} z e^{-i\beta})");
  e.code = [](const Parameters&) { return CodeFragment{"pd_synchronous", {"FXLMS"}}; };
  return e;
}

LawEntry pd_notch_law() {
  LawEntry e = synchronous<SynchronousCanceller::Method::notch>(
      "pd_notch", "PD with a generalised notch at 1x", "Herzog 1996", kPerTime, "generalised notch",
      R"(q \leftarrow q - h \mu e^{-i \arg G} z e^{-i\beta})");
  e.code = [](const Parameters&) { return CodeFragment{"pd_synchronous", {"NOTCH"}}; };
  return e;
}

}  // namespace whirl::control
