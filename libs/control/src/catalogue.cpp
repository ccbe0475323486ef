#include "whirl/control/catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/control/controller.hpp"
#include "whirl/control/power.hpp"
#include "whirl/core/error.hpp"

namespace whirl::control {
namespace {

constexpr double kDerived = std::numeric_limits<double>::quiet_NaN();

const ParameterInfo kSurface{
    "surface_gain", "1/s", "C of the sliding surface (length unit 1 mm)", 60, 0.1, 5000, 5, 1000};
const ParameterInfo kSwitching{
    "switching_gain", "m/s^2", "rho, must exceed the disturbance bound", 3, 1e-3, 1e3, 0.2, 20};
const ParameterInfo kLayer{"boundary_layer",
                           "m/s",
                           "eps; default h rho (n+1)^(n+1)/n^n for n samples of delay",
                           kDerived,
                           1e-6,
                           1e3,
                           0.005,
                           1};
const ParameterInfo kExponent{
    "exponent", "1", "r = q/p of the terminal surface; below 1/2 the law is unbounded on s = 0", 0.7, 0.5, 0.999,
    0.55,       0.98};
const ParameterInfo kDelta{
    "delta", "m", "regularisation length of the singular term; default from the loop gain limit", kDerived, 1e-9, 1e-2,
    2e-6,    2e-4};
const ParameterInfo kLength{"length_scale", "m", "length unit L of the surface gain", 1e-3, 1e-9, 1e3, 0, 0};
const ParameterInfo kTau{"tau", "s", "time constant of the projection; default h (n+1)^(n+1)/n^n", kDerived, 1e-6, 1,
                         1e-3,  5e-2};
const ParameterInfo kKp{"kp", "1/s^2", "proportional gain; negative takes stiffness away", 0, -1e7, 1e7, -6000, 12000};
const ParameterInfo kKd{"kd", "1/s", "derivative gain", 60, 0, 1e5, 5, 1000};

ParameterInfo paper_delta() {
  ParameterInfo p = kDelta;
  p.meaning = "regularisation length; 0: the singular term as printed";
  p.fallback = 0;
  p.low = p.tune_low = p.tune_high = 0;
  return p;
}

std::vector<MethodInfo> make_laws() {
  const ParameterInfo slow{"speed_min", "rad/s", "no adaptation below this speed", 10, 0, 1e6, 0, 0};
  const ParameterInfo per_turn{"adaptation", "1", "mu, part of the correction made per turn", 0.3, 0, 2, 0.02, 1};
  const ParameterInfo per_time{"adaptation", "1/s", "mu of the update", 3, 0, 1e4, 0.3, 100};
  const ParameterInfo rate{
      "twisting_rate", "m/s^3", "L, bound of the rate of the disturbance", 100, 1e-3, 1e6, 2, 2000};
  const ParameterInfo limit{"twisting_limit", "m/s^2", "bound of the integral part", 10, 1e-3, 1e3, 0, 0};
  const std::vector<ParameterInfo> weights{
      {"position_scale", "m", "displacement weighted as 1", 1e-3, 1e-9, 1e3, 1e-5, 1e-2},
      {"velocity_scale", "m/s", "velocity weighted as 1", 0.05, 1e-9, 1e3, 1e-3, 1},
      {"control_scale", "m/s^2", "control acceleration weighted as 1", 3, 1e-9, 1e6, 0, 0}};
  std::vector<ParameterInfo> with_horizon = weights;
  with_horizon.push_back(
      {"horizon", "1", "samples ahead in which the limit is seen", 12, 1, BoundedRegulator::kMaxHorizon, 0, 0});
  return {
      {"tsmc_paper",
       "terminal sliding mode as printed (eq. 43)",
       "paper eqs. 27, 35, 36, 43",
       {kSurface, kSwitching, kLayer, kExponent, paper_delta(), kLength}},
      {"tsmc",
       "terminal sliding mode, regularised",
       "paper eq. 43; singular term blended, layer from the loop delay",
       {kSurface, kSwitching, kLayer, kExponent, kDelta, kLength}},
      {"pd", "proportional-derivative", "paper section VII-B", {kKp, kKd}},
      {"pid",
       "proportional-integral-derivative",
       "clamped integrator",
       {kKp,
        kKd,
        {"ki", "1/s^3", "integral gain", 1000, 0, 1e8, 10, 1e5},
        {"integral_limit", "m/s^2", "bound of the integral part", 5, 0, 1e3, 0, 0}}},
      {"lqr", "linear-quadratic regulator", "discrete Riccati equation, predicted state", weights},
      {"mpc", "model predictive control with the force limit",
       "quadratic program solved exactly in every step; Riccati terminal cost", with_horizon},
      {"lsmc", "linear sliding mode", "s = v + C x", {kSurface, kSwitching, kLayer}},
      {"ntsmc",
       "nonsingular terminal sliding mode",
       "Feng, Yu, Man 2002",
       {kSurface, kSwitching, kLayer, kExponent, kLength}},
      {"ftsmc",
       "fast terminal sliding mode",
       "Yu, Man 2002",
       {{"linear_gain", "1/s", "alpha of the linear part", 30, 0, 5000, 2, 300},
        kSurface,
        kSwitching,
        kLayer,
        kExponent,
        kDelta,
        kLength}},
      {"nftsmc",
       "nonsingular fast terminal sliding mode",
       "Yang, Yang 2011",
       {kSurface,
        kSwitching,
        kLayer,
        kExponent,
        kLength,
        {"fast_gain", "1", "kappa of the fast term", 0.2, 0, 1e3, 0.02, 5},
        {"fast_exponent", "1", "a1 > 1/r; default 1/r + 0.2", kDerived, 1, 10, 0, 0}}},
      {"sta", "super-twisting, explicit", "Levant 1998; Moreno, Osorio 2012", {kSurface, rate, limit}},
      {"smc_implicit", "linear sliding mode, implicit", "Acary, Brogliato, Orlov 2012", {kSurface, kSwitching, kTau}},
      {"tsmc_implicit",
       "terminal sliding mode, implicit set-point",
       "backward Euler on the surface",
       {kSurface, kSwitching, kTau, kExponent, kLength}},
      {"sta_implicit", "super-twisting, implicit", "Brogliato, Polyakov, Efimov 2020", {kSurface, rate, limit}},
      {"asmc",
       "adaptive-gain sliding mode",
       "Plestan, Shtessel, Bregeault, Poznyak 2010",
       {kSurface,
        {"boundary_layer", "m/s", "eps; default from gain_max as rho", kDerived, 1e-6, 1e3, 0.005, 1},
        {"adaptation_rate", "1/s^2", "growth of the gain per |s|", 500, 0, 1e8, 10, 1e5},
        {"dead_zone", "m/s", "mu; default 4 gain_max h", kDerived, 0, 1e3, 0, 0},
        {"gain_min", "m/s^2", "smallest gain", 0.1, 0, 1e3, 0, 0},
        {"gain_max", "m/s^2", "largest gain", 10, 1e-3, 1e3, 1, 20}}},
      {"bsmc",
       "barrier-function sliding mode",
       "Obeid, Fridman, Laghrouche, Harmouche 2018",
       {kSurface,
        {"barrier_width", "m/s", "e: |s| is kept below", 0.1, 1e-6, 1e3, 0.01, 1},
        {"barrier_gain", "m/s^2", "K0", 1, 1e-6, 1e3, 0.05, 20},
        {"gain_max", "m/s^2", "largest gain", 10, 1e-3, 1e3, 0, 0}}},
      {"pd_influence", "PD with 1x influence coefficients", "once per turn", {kKp, kKd, per_turn, slow}},
      {"pd_fxlms", "PD with filtered-x LMS at 1x", "quadrature form", {kKp, kKd, per_time, slow}},
      {"pd_notch", "PD with a generalised notch at 1x", "Herzog 1996", {kKp, kKd, per_time, slow}},
  };
}

std::vector<MethodInfo> make_estimators() {
  const ParameterInfo r{
      "measurement_noise", "m", "rms noise of a displacement reading, runout included", 1.2e-6, 1e-9, 1e-2, 0, 0};
  const ParameterInfo q{"acceleration_noise",
                        "m/s^2",
                        "rms of the acceleration the model leaves out, per sample",
                        0.5,
                        1e-6,
                        1e4,
                        0.02,
                        20};
  const ParameterInfo red{"derivative_rate", "m/s^2", "L, bound of |x''|", 20, 1e-3, 1e6, 2, 500};
  return {
      {"difference", "backward difference", "", {}},
      {"lpf",
       "filtered backward difference",
       "first-order low-pass",
       {{"cutoff", "Hz", "low-pass of the velocity", 200, 1, 1e5, 30, 450}}},
      {"red", "robust exact differentiator, explicit", "Levant 1998", {red}},
      {"red_implicit", "robust exact differentiator, implicit", "Brogliato, Polyakov, Efimov 2020", {red}},
      {"eso",
       "linear extended state observer in rotor form",
       "Gao 2003; Miklosovic, Radke, Gao 2006",
       {{"bandwidth", "1/s", "observer poles", 300, 1, 1e4, 50, 1200}}},
      {"kalman", "Kalman filter, position and velocity", "model-based prediction", {r, q}},
      {"kfe",
       "Kalman filter with the eccentricity as states",
       "model-based prediction; needs the angle",
       {r,
        q,
        {"eccentricity_walk", "m/sqrt(s)", "random walk of the eccentricity", 2e-5, 0, 1, 2e-6, 2e-3},
        {"eccentricity_prior", "m", "sd of the model's eccentricity at the start", 1e-4, 0, 1, 0, 0}}},
      {"kfo",
       "Kalman filter with an oscillator at the speed",
       "model-based prediction; needs the speed only",
       {r,
        q,
        {"oscillator_walk", "m/s^2/sqrt(s)", "random walk of the disturbance amplitude", 1, 0, 1e4, 0.05, 50},
        {"oscillator_prior", "m/s^2", "sd of the disturbance at the start", 5, 0, 1e4, 0, 0}}},
  };
}

std::vector<ParameterInfo> make_common() {
  std::vector<ParameterInfo> p{
      {"sensor_delay", "s", "age of the displacement at the tick, part of the loop delay", 0, 0, 1, 0, 0},
      {"advance", "1", "1: disturbance taken at the time of effect; 0: at the tick, as printed", 1, 0, 1, 0, 0},
      {"predict", "1", "1: position and velocity predicted to the time of effect", 0, 0, 1, 0, 0},
      {"cancel", "1", "fraction of the linear stiffness that model-based laws cancel", 1, 0, 1, 0.4, 1},
      {"sensor_range", "m", "|x|, |y| at or above this is a saturated sensor", 12.4e-3, 1e-6, 1e3, 0, 0},
      {"jump_limit", "m", "largest plausible change of the displacement in one sample", 2e-3, 1e-9, 1e3, 0, 0},
      {"stale_limit", "1", "lost samples in a row after which the step faults", 100, 1, 1e9, 0, 0},
  };
  for (const char* axis : {"x", "y"}) {
    for (const char* part : {"cos", "sin"}) {
      for (int k = 1; k <= Runout::kHarmonics; ++k) {
        p.push_back(
            {fmt::format("runout_{}_{}_{}", axis, part, k), "m", "sensor runout removed", 0, -1e-2, 1e-2, 0, 0});
      }
    }
  }
  return p;
}

const MethodInfo& find(const std::vector<MethodInfo>& all, std::string_view name, std::string_view field) {
  std::string known;
  for (const auto& info : all) {
    if (info.name == name) return info;
    known += (known.empty() ? "" : ", ") + info.name;
  }
  throw Error::in_field(field, name, "one of " + known);
}

bool has(const std::map<std::string, double>& values, const char* name) { return values.count(name) > 0; }

int delay_samples(const ControllerDesign& design, const std::map<std::string, double>& values) {
  return values.at("predict") > 0 ? 0 : static_cast<int>(std::lround(design.delay / design.sample_time));
}

}  // namespace

const std::vector<MethodInfo>& laws() {
  static const std::vector<MethodInfo> all = make_laws();
  return all;
}
const std::vector<MethodInfo>& estimators() {
  static const std::vector<MethodInfo> all = make_estimators();
  return all;
}
const std::vector<ParameterInfo>& common_parameters() {
  static const std::vector<ParameterInfo> all = make_common();
  return all;
}
const MethodInfo& law_info(std::string_view name) { return find(laws(), name, "law"); }
const MethodInfo& estimator_info(std::string_view name) { return find(estimators(), name, "estimator"); }

std::map<std::string, double> resolve_parameters(const ControllerDesign& design) {
  require_range("sample_time", design.sample_time, 1e-6, 1, "s");
  require_range("delay", design.delay, 0, Controller::kMaxDelay * design.sample_time, "s");
  std::vector<ParameterInfo> known = law_info(design.law).parameters;
  const auto& more = estimator_info(design.estimator).parameters;
  known.insert(known.end(), more.begin(), more.end());
  known.insert(known.end(), common_parameters().begin(), common_parameters().end());

  std::map<std::string, double> values;
  for (const auto& info : known) {
    const auto given = design.parameters.find(info.name);
    values[info.name] = given != design.parameters.end() ? given->second : info.fallback;
    if (given != design.parameters.end())
      require_range(info.name, given->second, info.low, info.high, info.unit == "1" ? "" : info.unit);
  }
  for (const auto& [name, value] : design.parameters) {
    if (!values.count(name)) {
      std::string allowed;
      for (const auto& info : known) {
        if (!info.name.starts_with("runout_")) allowed += (allowed.empty() ? "" : ", ") + info.name;
      }
      throw Error(fmt::format("parameter {} is not known to law {} with estimator {}: known are {}", name, design.law,
                              design.estimator, allowed));
    }
  }

  const double h = design.sample_time;
  const int n = delay_samples(design, values);
  if (has(values, "boundary_layer") && std::isnan(values["boundary_layer"])) {
    const double rho = has(values, "switching_gain") ? values["switching_gain"] : values["gain_max"];
    values["boundary_layer"] = boundary_layer_limit(h, rho, n);
  }
  if (has(values, "delta") && std::isnan(values["delta"])) {
    values["delta"] = std::clamp(
        regularisation_limit(h, values["surface_gain"], values["exponent"], values["length_scale"], n), 1e-9, 1e-2);
  }
  if (has(values, "tau") && std::isnan(values["tau"])) values["tau"] = h / smooth_gain_limit(n);
  if (has(values, "dead_zone") && std::isnan(values["dead_zone"])) values["dead_zone"] = 4 * values["gain_max"] * h;
  if (has(values, "fast_exponent")) {
    double& a1 = values["fast_exponent"];
    const double g = 1 / values["exponent"];
    if (std::isnan(a1)) a1 = g + 0.2;
    if (!(a1 > g)) {
      throw Error::in_field("fast_exponent", fmt::format("{:g}", a1), fmt::format("above 1/exponent = {:g}", g));
    }
  }
  if (has(values, "gain_min") && values["gain_min"] > values["gain_max"]) {
    throw Error::in_field("gain_min", fmt::format("{:g} m/s^2", values["gain_min"]), "at most gain_max");
  }
  if (values["sensor_delay"] > design.delay) {
    throw Error::in_field("sensor_delay", fmt::format("{:g} s", values["sensor_delay"]),
                          fmt::format("part of the loop delay {:g} s", design.delay));
  }
  return values;
}

std::vector<std::string> design_warnings(const ControllerDesign& design) {
  const auto values = resolve_parameters(design);
  const double h = design.sample_time;
  const int n = delay_samples(design, values);
  std::vector<std::string> out;
  if (has(values, "boundary_layer") && has(values, "switching_gain")) {
    const double limit = boundary_layer_limit(h, values.at("switching_gain"), n);
    if (values.at("boundary_layer") < 0.999 * limit) {
      out.push_back(
          fmt::format("boundary_layer {:.3g} m/s is below {:.3g} m/s: the switching term oscillates with {} "
                      "samples of delay",
                      values.at("boundary_layer"), limit, n));
    }
  }
  if (has(values, "delta") && values.at("delta") > 0) {
    const double r = values.at("exponent");
    const double gain =
        h * values.at("surface_gain") * r * std::pow(values.at("delta") / values.at("length_scale"), r - 1);
    if (gain > 1.001 * smooth_gain_limit(n)) {
      out.push_back(
          fmt::format("the terminal surface has the sampled velocity gain {:.3g} near zero, above {:.3g} it "
                      "oscillates with {} samples of delay: lower surface_gain or raise delta",
                      gain, smooth_gain_limit(n), n));
    }
  } else if (has(values, "delta")) {
    out.push_back("delta = 0: the singular term as printed is unbounded when the displacement crosses zero");
  }
  if (has(values, "tau") && values.at("tau") < 0.999 * h / smooth_gain_limit(n)) {
    out.push_back(fmt::format("tau {:.3g} s is below {:.3g} s: the projection oscillates with {} samples of delay",
                              values.at("tau"), h / smooth_gain_limit(n), n));
  }
  return out;
}

}  // namespace whirl::control
