#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "rotor_parameters.hpp"
#include "template.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/control/method.hpp"
#include "whirl/control/reidentifier_numbers.hpp"
#include "whirl/control/supervision_numbers.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/code.hpp"
#include "written.hpp"

namespace whirl::deploy {
namespace {

bool has_runout(const std::map<std::string, double>& values) {
  return std::any_of(values.begin(), values.end(),
                     [](const auto& v) { return v.first.starts_with("runout_") && v.second != 0; });
}

/// Structural modes up to the last one that takes part.
int modes_of(const std::map<std::string, double>& values) {
  for (int k = control::Structure::kModes; k > 0; --k) {
    if (values.at(fmt::format("mode_{}_share", k)) != 0 && values.at(fmt::format("mode_{}_omega", k)) > 0) return k;
  }
  return 0;
}

/// Structure that is fixed at export and therefore no parameter.
bool is_switch(const std::string& name) {
  return name == "advance" || name == "predict" || name == "supervise" || name == "reidentify";
}

bool reidentifies(const std::map<std::string, double>& values) {
  return values.at("supervise") > 0 && std::lround(values.at("reidentify")) > 0;
}

std::vector<CodeParameter> parameters_of(const ControllerDesign& d, const std::map<std::string, double>& values) {
  std::vector<CodeParameter> out;
  const auto add = [&](const control::ParameterInfo& info, double value) {
    if (is_switch(info.name) || (info.name.starts_with("runout_") && !has_runout(values))) return;
    if (info.name.starts_with("mode_") && info.name[5] - '0' > modes_of(values)) return;
    if (info.name.starts_with("reidentify_") && !reidentifies(values)) return;
    if (info.name.starts_with("watch_") && values.at("supervise") == 0) return;
    out.push_back({info.name, info.unit, info.meaning, value, info.low, info.high});
  };
  const control::LawEntry& law = control::law_entry(d.law);
  if (law.code_parameters != nullptr) {
    for (const auto& [info, value] : law.code_parameters(d, values)) add(info, value);
  } else {
    for (const control::ParameterInfo& info : law.info.parameters) add(info, values.at(info.name));
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
  out.push_back({"max_gap", "1", "sample times left out at once above which a step refuses; 0: never", 100, 0, 1e6});
  out.push_back({"max_fill", "1", "steps taken at most for sample times that were left out", 64, 0, 1000});
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
  std::map<std::string, int> numbers;
  const auto refuse = [&](const std::string& condition, int which) {
    out += fmt::format("{}  if (!({})) {{\n    return {};\n  }}", out.empty() ? "" : "\n", condition, which);
  };
  for (const CodeParameter& p : all) {
    const int number = numbers[p.name] = static_cast<int>(numbers.size()) + 1;
    if (std::isinf(p.high)) {
      refuse(fmt::format("isfinite(p->{})", p.name), number);
    } else {
      refuse(fmt::format("(p->{0} >= {1}) && (p->{0} <= {2})", p.name, bound(p.low, true, single),
                         bound(p.high, false, single)),
             number);
    }
  }
  for (const control::Condition& condition : control::law_entry(d.law).conditions) {
    refuse(condition.c, numbers.at(condition.parameter));
  }
  refuse("p->sensor_delay <= p->delay", numbers.at("sensor_delay"));
  refuse("p->delay <= ((whirl_real)WHIRL_MAX_DELAY * p->sample_time)", numbers.at("delay"));
  return out;
}

std::string default_lines(const std::vector<CodeParameter>& all, bool single) {
  std::string out = "void whirl_default_params(whirl_params *params) {\n";
  for (const CodeParameter& p : all) out += fmt::format("  params->{} = {};\n", p.name, c_literal(p.value, single));
  return out + "}\n";
}

/// Resolves a method's fragment with its own switches and slots: its sections become the slots KIND_SECTION of `s`.
void add_fragment(TemplateSettings& s, const std::string& kind, const std::string& file,
                  const control::CodeFragment& code) {
  TemplateSettings own = s;
  own.features.insert(code.features.begin(), code.features.end());
  for (const auto& [name, text] : code.slots) own.slots[name] = text;
  const auto sections = template_sections(deploy_template(file), own);
  for (const char* section :
       {"constants", "types", "derived", "state", "set_params", "reset", "body", "functions", "call", "add", "whole"}) {
    const auto found = sections.find(section);
    s.slots[kind + "_" + section] = found != sections.end() ? found->second : "";
  }
}

TemplateSettings settings_of(const ControllerDesign& d, const std::map<std::string, double>& values,
                             const CodeOptions& options) {
  TemplateSettings s;
  s.prefix = options.prefix;
  s.single_precision = options.single_precision;
  auto& on = s.features;
  const control::LawEntry& law = control::law_entry(d.law);
  const control::EstimatorEntry& estimator = control::estimator_entry(d.estimator);
  const control::CodeFragment law_code = law.code(values), estimator_code = estimator.code(values);
  if (law.model_free) on.insert("MODEL_FREE");
  if (law.cancels_synchronous) on.insert("SYNCHRONOUS");
  if (!law_code.memory.empty()) on.insert("AXIS_MEMORY");
  if (d.feedforward) on.insert("FEEDFORWARD");
  if (values.at("predict") > 0) {
    on.insert("PREDICT");
  } else if (values.at("advance") > 0) {
    on.insert("ADVANCE");
  }
  if (has_runout(values)) on.insert("RUNOUT");
  if (const int modes = modes_of(values); modes > 0) {
    on.insert("STRUCTURE");
    s.slots["modes"] = fmt::format("{}", modes);
    for (int k = 1; k <= modes; ++k) {
      s.slots["mode_lines"] += fmt::format(
          "{0}  whirl_mode_set(&state->modes[{1}], p->mode_{2}_omega, p->mode_{2}_damping, p->mode_{2}_share, h, "
          "split);",
          k > 1 ? "\n" : "", k - 1, k);
    }
  }
  if (values.at("supervise") > 0) {
    on.insert("SUPERVISION");
#define WHIRL_NUMBER(name, value) s.slots["n_" #name] = c_literal(value, options.single_precision);
    WHIRL_FORCE_CHECK_NUMBERS(WHIRL_NUMBER)
    WHIRL_SUPERVISOR_NUMBERS(WHIRL_NUMBER)
#undef WHIRL_NUMBER
    if (!d.feedforward && !law.cancels_synchronous) on.insert("CARRIED");
  }
  if (reidentifies(values)) {
    on.insert("REIDENTIFY");
    if (std::lround(values.at("reidentify")) == 2) on.insert("CORRECTED");
#define WHIRL_NUMBER(name, value) s.slots["n_reid_" #name] = c_literal(value, options.single_precision);
    WHIRL_REIDENTIFIER_NUMBERS(WHIRL_NUMBER)
#undef WHIRL_NUMBER
    s.slots["n_reid_rate_rad"] =
        c_literal(control::reidentification::rate / (2 * std::numbers::pi), options.single_precision);
  }
  if (d.feedforward && !estimator.finds_disturbance) on.insert("FIXED");

  auto& slots = s.slots;
  const bool single = options.single_precision;
  slots["real"] = single ? "float" : "double";
  slots["angle"] =
      single ? ", wrapped by the caller to -pi..pi: float loses an angle that grows" : ", continuous or wrapped";
  slots["memory"] = law_code.memory;
  slots["memory_start"] = law_code.memory_start;
  slots["regularised"] = "";
  slots["law"] = law.equation;
  slots["f"] = law.model_free ? "the disturbance d by unbalance"
                              : "the acceleration without control: stiffness, damping and unbalance";
  slots["slack"] = single ? "1e-5F" : "1e-12";
  slots["reached"] = single ? "0.999999F" : "0.999999999999";
  slots["whole"] = single ? "1e-4F" : "1e-9";
  add_fragment(s, "law", "laws/" + law_code.file, law_code);
  add_fragment(s, "estimator", "estimators/" + estimator_code.file, estimator_code);
  if (!slots["law_call"].empty()) on.insert("OWN_CALL");
  if (!slots["law_functions"].empty()) on.insert("LAW_FUNCTIONS");
  on.insert(law_code.features.begin(), law_code.features.end());
  for (const auto& [name, text] : law_code.slots) slots[name] = text;
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
      options.origin.empty() ? "" : "\n   from " + c_comment(options.origin), options.prefix);
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
  if (options.single_precision && control::law_entry(design.law).continuous_angle) {
    throw Error("law " + design.law +
                " counts whole turns on an angle that grows, which float cannot hold: export it in double");
  }
  const std::map<std::string, double> values = control::resolve_parameters(design);
  if (options.single_precision && reidentifies(values)) {
    throw Error("reidentify " + fmt::format("{:g}", values.at("reidentify")) +
                ": float does not hold the sums of its least squares: export it in double");
  }
  ControllerCode code;
  code.parameters = parameters_of(design, values);
  TemplateSettings s = settings_of(design, values, options);
  s.slots["parameters"] = parameter_lines(code.parameters);
  s.slots["checks"] = check_lines(design, code.parameters, options.single_precision);
  s.slots["parameter_count"] = std::to_string(code.parameters.size());
  std::string &names = s.slots["parameter_names"], &cases = s.slots["parameter_cases"];
  int number = 0;
  for (const CodeParameter& p : code.parameters) {
    names += fmt::format("{}      \"{}\"", names.empty() ? "" : ",\n", p.name);
    cases += fmt::format("{}    case {}:\n      next.{} = value;\n      break;", cases.empty() ? "" : "\n", ++number,
                         p.name);
  }
  s.slots["banner"] = banner(design, options);
  code.header = {options.prefix + ".h", fill_template(deploy_template("controller.h"), s)};
  std::string source = s.slots["banner"] + "\n#include \"" + options.prefix + ".h\"\n\n#include <math.h>\n\n";
  const auto part = [&](std::string_view text) { source += fill_template(text, s) + "\n"; };
  part(deploy_template("motion.c"));
  part("/*@estimator_functions@*/\n");
  part(deploy_template("implicit_power.c"));
  part(deploy_template("structure.c"));
  part(deploy_template("force_fit.c"));
  part(deploy_template("force_check.c"));
  part(deploy_template("supervisor.c"));
  part(deploy_template("reidentifier.c"));
  part(s.slots["law_whole"].empty() ? std::string(deploy_template("laws.c")) : "/*@law_whole@*/\n");
  source += fill_template(default_lines(code.parameters, options.single_precision) + "\n", s);
  for (const char* name : {"controller.c", "gap.c", "parameter.c"}) source += fill_template(deploy_template(name), s);
  code.source = {options.prefix + ".c", drop_unused_functions(source)};
  return code;
}

}  // namespace whirl::deploy
