#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "rotor_parameters.hpp"
#include "template.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/code.hpp"

namespace whirl::deploy {
namespace {

bool has_runout(const std::map<std::string, double>& values) {
  return std::any_of(values.begin(), values.end(),
                     [](const auto& v) { return v.first.starts_with("runout_") && v.second != 0; });
}

/// Structure that is fixed at export and therefore no parameter.
bool is_switch(const std::string& name) { return name == "advance" || name == "predict"; }

std::vector<CodeParameter> parameters_of(const ControllerDesign& d, const std::map<std::string, double>& values) {
  std::vector<CodeParameter> out;
  const auto add = [&](const control::ParameterInfo& info, double value) {
    if (is_switch(info.name) || (info.name.starts_with("runout_") && !has_runout(values))) return;
    out.push_back({info.name, info.unit, info.meaning, value, info.low, info.high});
  };
  if (d.law == "lqr") {
    const control::LqrGains g = control::lqr_gains(d.model.k1, d.model.c, d.sample_time, values.at("position_scale"),
                                                   values.at("velocity_scale"), values.at("control_scale"));
    for (const control::ParameterInfo& info : control::law_info("pd").parameters)
      add(info, info.name == "kp" ? g.kp : g.kd);
  } else if (d.law == "mpc") {
    // Gains of the regulator per axis, as the library's law has them.
    for (const auto& [axis, side] : {std::pair("x", 1.0), std::pair("y", -1.0)}) {
      const control::LqrGains g = control::lqr_gains(
          d.model.k1 + side * d.model.k1_conj.real(), d.model.c + side * d.model.c_conj.real(), d.sample_time,
          values.at("position_scale"), values.at("velocity_scale"), values.at("control_scale"));
      for (control::ParameterInfo info : control::law_info("pd").parameters) {
        const double gain = info.name == "kp" ? g.kp : g.kd;
        info.name += fmt::format("_{}", axis);
        add(info, gain);
      }
    }
    for (const control::ParameterInfo& info : control::law_info("mpc").parameters) {
      if (info.name == "horizon") add(info, std::floor(values.at(info.name)));
    }
  } else {
    for (const control::ParameterInfo& info : control::law_info(d.law).parameters) add(info, values.at(info.name));
  }
  for (const control::ParameterInfo& info : control::estimator_info(d.estimator).parameters)
    add(info, values.at(info.name));
  for (const control::ParameterInfo& info : control::common_parameters()) {
    add(info, info.name == "stale_limit" ? std::floor(values.at(info.name)) : values.at(info.name));
  }
  const std::vector<CodeParameter> rotor = rotor_parameters(d.model);
  out.insert(out.end(), rotor.begin(), rotor.end());
  out.push_back({"gain", "1/kg", "acceleration per newton of actuator force", d.model.gain, 1e-12, 1e12});
  out.push_back({"force_limit", "N", "actuator limit; 0: none", d.force_limit, 0, 1e9});
  out.push_back({"sample_time", "s", "period in which the step is called", d.sample_time, 1e-6, 1});
  out.push_back({"delay", "s",
                 "loop delay assumed: sensor, computation, actuator lag, without the hold; at most 16 samples", d.delay,
                 0, 1});
  return out;
}

/// A bound as a literal that float cannot round past the value it admits.
std::string bound(double value, bool lower, bool single) {
  if (!single) return c_literal(value, false);
  const float f = static_cast<float>(value);
  const float next =
      std::nextafterf(f, lower ? -std::numeric_limits<float>::infinity() : std::numeric_limits<float>::infinity());
  return c_literal(value == 0 ? 0.0 : static_cast<double>(next), true);
}

std::string parameter_lines(const std::vector<CodeParameter>& all) {
  std::string out;
  int number = 0;
  for (const CodeParameter& p : all) {
    out += fmt::format("{}  /* {:2} */ whirl_real {}; /* {}{}{}", out.empty() ? "" : "\n", ++number, p.name,
                       p.unit == "1" ? "" : p.unit, p.unit == "1" ? "" : ", ", p.meaning);
    out += std::isinf(p.high) ? " */" : fmt::format("; {:g} to {:g} */", p.low, p.high);
  }
  return out;
}

std::string check_lines(const ControllerDesign& d, const std::vector<CodeParameter>& all, bool single) {
  std::string out;
  int number = 0, exponent = 0, fast = 0, gain_min = 0, sensor = 0, delay = 0;
  const auto refuse = [&](const std::string& condition, int which) {
    out += fmt::format("{}  if (!({})) {{\n    return {};\n  }}", out.empty() ? "" : "\n", condition, which);
  };
  for (const CodeParameter& p : all) {
    ++number;
    if (p.name == "exponent") exponent = number;
    if (p.name == "fast_exponent") fast = number;
    if (p.name == "gain_min") gain_min = number;
    if (p.name == "sensor_delay") sensor = number;
    if (p.name == "delay") delay = number;
    if (std::isinf(p.high)) {
      refuse(fmt::format("isfinite(p->{})", p.name), number);
    } else {
      refuse(fmt::format("(p->{0} >= {1}) && (p->{0} <= {2})", p.name, bound(p.low, true, single),
                         bound(p.high, false, single)),
             number);
    }
  }
  if (fast > 0 && exponent > 0) refuse("(p->fast_exponent * p->exponent) > R(1.0)", fast);
  if (gain_min > 0) refuse("p->gain_min <= p->gain_max", gain_min);
  refuse("p->sensor_delay <= p->delay", sensor);
  refuse("p->delay <= ((whirl_real)WHIRL_MAX_DELAY * p->sample_time)", delay);
  (void)d;
  return out;
}

std::string default_lines(const std::vector<CodeParameter>& all, bool single) {
  std::string out = "void whirl_default_params(whirl_params *params) {\n";
  for (const CodeParameter& p : all) out += fmt::format("  params->{} = {};\n", p.name, c_literal(p.value, single));
  return out + "}\n";
}

TemplateSettings settings_of(const ControllerDesign& d, const std::map<std::string, double>& values,
                             const CodeOptions& options) {
  TemplateSettings s;
  s.prefix = options.prefix;
  s.single_precision = options.single_precision;
  auto& on = s.features;
  const bool pd = d.law == "pd" || d.law == "lqr" || d.law.starts_with("pd_");
  if (pd) {
    on.insert("PD");
  } else if (d.law.starts_with("sta")) {
    on.insert("STA");
  } else if (d.law == "tsmc_paper") {
    on.insert("TSMC");
  }
  std::string upper = d.law;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  on.insert(upper);
  if (d.law.starts_with("pd_")) {
    on.insert("SYNCHRONOUS");
    on.insert(upper.substr(3));  // INFLUENCE, FXLMS, NOTCH
  }
  const bool model_free = pd || d.law == "pid" || d.law == "mpc";  // f is the disturbance alone
  if (model_free) on.insert("MODEL_FREE");
  if (d.law == "pid" || d.law == "asmc" || on.contains("STA")) on.insert("AXIS_MEMORY");
  std::string regularised;
  if (d.law == "tsmc" || d.law == "ftsmc") {
    on.insert("BLEND");
    regularised = "; linear plus\n   quadratic inside |x| < delta, where the slope of the power is unbounded";
  } else if (d.law == "tsmc_paper" && values.at("delta") > 0) {
    on.insert("CLAMP");
    regularised = " taken at |x| >= delta";
  }
  if (on.contains("TSMC") || d.law == "ftsmc") on.insert("POWER");

  if (d.estimator == "lpf" || d.estimator == "difference") on.insert("LPF");
  if (d.estimator == "lpf") on.insert("CUTOFF");
  if (d.estimator.starts_with("red")) on.insert("RED");
  if (d.estimator == "red_implicit") on.insert("IMPLICIT_RED");
  if (d.estimator == "eso") on.insert("ESO");
  if (d.estimator == "kalman" || d.estimator == "kfe" || d.estimator == "kfo") on.insert("KALMAN");
  if (d.estimator == "kfe" || d.estimator == "kfo") on.insert("THIRD");
  if (d.estimator == "kfo") on.insert("OSCILLATOR");
  if (d.estimator == "kalman" || d.estimator == "kfo") on.insert("NO_FORCING");
  if (d.feedforward) on.insert("FEEDFORWARD");
  if (values.at("predict") > 0) {
    on.insert("PREDICT");
  } else if (values.at("advance") > 0) {
    on.insert("ADVANCE");
  }
  if (has_runout(values)) on.insert("RUNOUT");

  auto& slots = s.slots;
  const bool oscillator = d.estimator == "kfo", single = options.single_precision;
  slots["real"] = single ? "float" : "double";
  slots["angle"] =
      single ? ", wrapped by the caller to -pi..pi: float loses an angle that grows" : ", continuous or wrapped";
  if (d.law == "pd_influence") slots["angle"] = ", continuous";
  slots["theta"] = oscillator ? "m/s^2, amplitude of the disturbance" : "m, eccentricity";
  slots["walk"] = oscillator ? "oscillator_walk" : "eccentricity_walk";
  slots["prior"] = oscillator ? "oscillator_prior" : "eccentricity_prior";
  slots["kalman"] = d.estimator == "kalman" ? "(z, v)"
                    : oscillator            ? "(z, v, disturbance amplitude)"
                                            : "(z, v, eccentricity)";
  slots["memory"] = d.law == "pid"    ? "m/s^2, integral part"
                    : d.law == "asmc" ? "m/s^2, adaptive gain"
                                      : "m/s^2, integral part of the twisting law";
  slots["regularised"] = regularised;
  slots["law"] = law_equation(d.law).text;
  slots["f"] = model_free ? "the disturbance d by unbalance"
                          : "the acceleration without control: stiffness, damping and unbalance";
  slots["tolerance"] = single ? "1e-7F" : "1e-15";
  slots["slack"] = single ? "1e-5F" : "1e-12";
  slots["reached"] = single ? "0.999999F" : "0.999999999999";
  slots["whole"] = single ? "1e-4F" : "1e-9";
  return s;
}

std::string banner(const ControllerDesign& d, const CodeOptions& options) {
  return fmt::format(
      "/* {0}: {1}\n   with the estimator: {2}.\n\n   Made by whirl {3}{4}.\n   SI units throughout. C99, no "
      "allocation, no input or "
      "output, no globals: all memory is in {5}_state, several\n   instances may live side by side. Needs the "
      "functions of math.h; do "
      "not compile with -ffast-math, which removes the\n   tests for NaN. */",
      options.prefix, control::law_info(d.law).title, control::estimator_info(d.estimator).title, version(),
      options.origin.empty() ? "" : "\n   from " + options.origin, options.prefix);
}

}  // namespace

void require_prefix(const std::string& prefix) {
  static constexpr std::array keywords{"auto",    "break",  "case",     "char",   "const",    "continue", "default",
                                       "do",      "double", "else",     "enum",   "extern",   "float",    "for",
                                       "goto",    "if",     "inline",   "int",    "long",     "register", "restrict",
                                       "return",  "short",  "signed",   "sizeof", "static",   "struct",   "switch",
                                       "typedef", "union",  "unsigned", "void",   "volatile", "while"};
  const bool letters = !prefix.empty() && prefix.size() <= 24 && prefix[0] >= 'a' && prefix[0] <= 'z' &&
                       std::all_of(prefix.begin(), prefix.end(),
                                   [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; });
  if (!letters || std::find(keywords.begin(), keywords.end(), prefix) != keywords.end()) {
    throw Error::in_field("prefix", prefix,
                          "1 to 24 lower-case letters, digits and underscores, a letter first, and no word of C");
  }
}

ControllerCode controller_code(const ControllerDesign& design, const CodeOptions& options) {
  require_prefix(options.prefix);
  control::make_controller(design);  // refuses what the library refuses, with its words
  if (options.single_precision && design.law == "pd_influence") {
    throw Error(
        "law pd_influence counts whole turns on an angle that grows, which float cannot hold: export it in double");
  }
  const std::map<std::string, double> values = control::resolve_parameters(design);
  ControllerCode code;
  code.parameters = parameters_of(design, values);
  TemplateSettings s = settings_of(design, values, options);
  s.slots["parameters"] = parameter_lines(code.parameters);
  s.slots["checks"] = check_lines(design, code.parameters, options.single_precision);
  s.slots["banner"] = banner(design, options);
  code.header = {options.prefix + ".h", fill_template(deploy_template("controller.h"), s)};
  std::string source = s.slots["banner"] + "\n#include \"" + options.prefix + ".h\"\n\n#include <math.h>\n\n";
  const char* const law = design.law == "mpc" ? "predictive.c" : "laws.c";
  for (const char* part : {"motion.c", "estimators.c", "implicit_power.c", law}) {
    source += fill_template(deploy_template(part), s) + "\n";
  }
  source += fill_template(default_lines(code.parameters, options.single_precision) + "\n", s);
  source += fill_template(deploy_template("controller.c"), s);
  code.source = {options.prefix + ".c", drop_unused_functions(source)};
  return code;
}

}  // namespace whirl::deploy
