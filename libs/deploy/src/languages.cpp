#include "whirl/deploy/languages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "template.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/core/error.hpp"
#include "written.hpp"

namespace whirl::deploy {
namespace {

std::string made_by(const CodeOptions& o) {
  return fmt::format("Made by whirl {}{}. SI units.", version(),
                     o.origin.empty() ? "" : " from " + line_comment(o.origin));
}

std::string names(const std::vector<SystemVariable>& all, const char* separator = ", ") {
  std::string out;
  for (const SystemVariable& v : all) out += (out.empty() ? "" : separator) + v.name;
  return out;
}

/// "12.3 \cdot 10^{4}" for a document.
std::string latex_number(double value) {
  const std::string text = fmt::format("{:.5g}", value);
  const std::size_t e = text.find('e');
  return e == std::string::npos
             ? text
             : text.substr(0, e) + " \\cdot 10^{" + std::to_string(std::stoi(text.substr(e + 1))) + "}";
}

/// The rotor's names as its equations are written; other names as `expr` writes them.
std::string latex_symbol(std::string_view name) {
  static const std::map<std::string, const char*, std::less<>> known{{"vx", "v_x"},
                                                                     {"vy", "v_y"},
                                                                     {"ux", "u_x"},
                                                                     {"uy", "u_y"},
                                                                     {"gain", "b"},
                                                                     {"eps_re", "\\varepsilon_{\\mathrm{re}}"},
                                                                     {"eps_im", "\\varepsilon_{\\mathrm{im}}"},
                                                                     {"k1_conj_re", "\\bar{k}_{\\mathrm{re}}"},
                                                                     {"k1_conj_im", "\\bar{k}_{\\mathrm{im}}"},
                                                                     {"c_conj_re", "\\bar{c}_{\\mathrm{re}}"},
                                                                     {"c_conj_im", "\\bar{c}_{\\mathrm{im}}"}};
  if (const auto found = known.find(name); found != known.end()) return found->second;
  if (name.starts_with("xi_")) {
    std::string index(name.substr(3));
    std::replace(index.begin(), index.end(), '_', ',');
    return "\\xi_{" + index + "}";
  }
  return expr::latex_name(name);
}

std::string latex_table(const std::vector<CodeParameter>& parameters, bool as_symbols) {
  std::string out = "\\begin{tabular}{lrll}\n\\toprule\nparameter & value & unit & meaning \\\\\n\\midrule\n";
  for (const CodeParameter& p : parameters) {
    if (p.name.starts_with("runout_") && p.value == 0) continue;
    out += fmt::format("{} & ${}$ & {} & {} \\\\\n", as_symbols ? "$" + latex_symbol(p.name) + "$" : latex_text(p.name),
                       latex_number(p.value), latex_text(p.unit), latex_text(p.meaning));
  }
  return out + "\\bottomrule\n\\end{tabular}\n";
}

/// MATLAB lines that give the elements of a vector their names.
std::string unpack(const std::vector<SystemVariable>& all, const std::string& from) {
  std::string out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    out += fmt::format("{} = {}({});  % {}, {}\n", all[i].name, from, i + 1, line_comment(all[i].unit),
                       line_comment(all[i].meaning));
  }
  return out;
}

bool is_parameter(const ModelSystem& s, std::string_view name) {
  return std::any_of(s.parameters.begin(), s.parameters.end(), [&](const CodeParameter& p) { return p.name == name; });
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::string modelica_unit(std::string unit) {
  std::erase(unit, '^');
  std::replace(unit.begin(), unit.end(), ' ', '.');
  return quoted_text(unit);
}

std::vector<SourceFile> with_source(const ControllerCode& code, SourceFile more) {
  return {code.header, code.source, std::move(more)};
}

TemplateSettings wrapper_settings(const ControllerDesign& design, const CodeOptions& o) {
  TemplateSettings s;
  s.prefix = o.prefix;
  s.features = {"CONTROLLER"};
  const auto values = control::resolve_parameters(design);
  if (values.at("supervise") > 0) s.features.insert("SUPERVISION");
  if (values.at("supervise") > 0 && std::lround(values.at("reidentify")) > 0) s.features.insert("REIDENTIFY");
  s.slots["prefix"] = o.prefix;
  s.slots["sample_time"] = expr::number_text(design.sample_time, true);
  s.slots["title"] =
      control::law_info(design.law).title + " with the estimator: " + control::estimator_info(design.estimator).title;
  std::string step = fill_template(deploy_template("step_values.c"), s);
  step.pop_back();  // the slot stands alone on its line
  s.slots["step_values"] = step;
  return s;
}

}  // namespace

std::vector<SourceFile> export_latex(const ControllerDesign& design, const CodeOptions& options) {
  const ControllerCode code = controller_code(design, options);
  std::string law = law_equation(design.law).latex;
  std::string rows;
  for (std::size_t at; (at = law.find(",\\quad ")) != std::string::npos; law.erase(0, at + 7))
    rows += "  " + law.substr(0, at) + " \\\\\n";
  rows += "  " + law + "\n";
  std::string text = fmt::format("% {}: {}. {}\n% Needs the packages amsmath and booktabs.\n", options.prefix,
                                 control::law_info(design.law).title, made_by(options));
  text +=
      "Per axis $\\dot x = v$, $\\dot v = f + a + D$, force $u = a/b$ with $b = " + latex_number(design.model.gain) +
      "\\,\\mathrm{kg^{-1}}$, $\\mathrm{sig}(x)^r = |x|^r\\,\\mathrm{sgn}\\,x$:\n\\begin{gather*}\n" + rows +
      "\\end{gather*}\n";
  return {{options.prefix + ".tex", text + latex_table(code.parameters, false)}};
}

std::vector<SourceFile> export_latex(const IdentifiedModel& model, const CodeOptions& options) {
  require_prefix(options.prefix);
  const ModelSystem s = model_system(model);
  std::string text = fmt::format("% {}: {}. {}\n% Needs the packages amsmath and booktabs.\n\\begin{{align*}}\n",
                                 options.prefix, line_comment(s.title), made_by(options));
  expr::PrintOptions print_options;
  print_options.name = latex_symbol;
  for (std::size_t i = 0; i < s.rates.size(); ++i) {
    const std::string name = latex_symbol(s.states[i].name);
    text += fmt::format("  {} &= {}{}\n", s.discrete ? name + "^{+}" : "\\dot{" + name + "}",
                        expr::print(s.rates[i], expr::Notation::latex, print_options),
                        i + 1 < s.rates.size() ? " \\\\" : "");
  }
  return {{options.prefix + ".tex", text + "\\end{align*}\n" + latex_table(s.parameters, true)}};
}

std::vector<SourceFile> export_matlab(const IdentifiedModel& model, const CodeOptions& o) {
  require_prefix(o.prefix);
  const ModelSystem s = with_names_for(Language::matlab, model_system(model));
  std::string text = fmt::format(
      "function [rate, output] = {0}(t, state, input, p)\n%{1}  {2}.\n%   [rate, output] = {0}(t, state, input, p)   "
      "{3}\n%   [rate, output] = "
      "{0}(t, state, input)      with the identified parameters\n%   p = {0}()                                  these "
      "parameters\n%\n%   state = "
      "[{4}], input = [{5}], output = [{6}]\n%   {7}\n",
      o.prefix, upper(o.prefix), line_comment(s.title),
      s.discrete ? "next states of the map" : "right-hand side for ode45 and others", names(s.states, " "),
      names(s.inputs, " "), names(s.outputs, " "), made_by(o));
  text += "if nargin < 4\n";
  for (const CodeParameter& p : s.parameters)
    text += fmt::format("  p.{} = {};  % {}, {}\n", p.name, expr::number_text(p.value), line_comment(p.unit),
                        line_comment(p.meaning));
  text += "end\nif nargin == 0\n  rate = p;\n  return\nend\n";
  text += unpack(s.states, "state") + unpack(s.inputs, "input");
  expr::PrintOptions print_options;
  print_options.name = [&s](std::string_view name) {
    return is_parameter(s, name) ? "p." + std::string(name) : std::string(name);
  };
  text += fmt::format("rate = zeros({}, 1);\n", s.rates.size());
  for (std::size_t i = 0; i < s.rates.size(); ++i)
    text += fmt::format("rate({}) = {};\n", i + 1, expr::print(s.rates[i], expr::Notation::matlab, print_options));
  text += fmt::format("output = zeros({}, 1);\n", s.outputs.size());
  for (std::size_t i = 0; i < s.outputs.size(); ++i) {
    text +=
        fmt::format("output({}) = {};\n", i + 1, expr::print(s.output_terms[i], expr::Notation::matlab, print_options));
  }
  return {{o.prefix + ".m", text + "end\n"}};
}

std::vector<SourceFile> export_matlab(const ControllerDesign& design, const CodeOptions& o) {
  const ControllerCode code = controller_code(design, o);
  return with_source(
      code, {o.prefix + "_mex.c", fill_template(deploy_template("controller_mex.c"), wrapper_settings(design, o))});
}

std::vector<SourceFile> export_python(const IdentifiedModel& model, const CodeOptions& o) {
  require_prefix(o.prefix);
  const ModelSystem s = with_names_for(Language::python, model_system(model));
  std::string text = fmt::format("\"\"\"{}.\n\n{} States: {}. Inputs: {}. Outputs: {}.\n\"\"\"\n", quoted_text(s.title),
                                 quoted_text(made_by(o)), names(s.states), s.inputs.empty() ? "none" : names(s.inputs),
                                 names(s.outputs));
  text +=
      "try:\n    import numpy as np\nexcept ImportError:  # the functions below for single numbers\n    import "
      "math\n\n    class np:\n"
      "        sin, cos, tan, tanh, exp, log, sqrt = math.sin, math.cos, math.tan, math.tanh, math.exp, math.log, "
      "math.sqrt\n"
      "        abs, minimum, maximum = abs, min, max\n\n        @staticmethod\n        def sign(x):\n            "
      "return (x > 0) - (x < 0)\n\n"
      "PARAMETERS = {\n";
  for (const CodeParameter& p : s.parameters)
    text += fmt::format("    \"{}\": {},  # {}, {}\n", p.name, expr::number_text(p.value, true), line_comment(p.unit),
                        line_comment(p.meaning));
  text += "}\n";
  expr::PrintOptions print_options;
  print_options.name = [&s](std::string_view name) {
    return is_parameter(s, name) ? "p[\"" + std::string(name) + "\"]" : std::string(name);
  };
  const auto function = [&](const char* name, const char* what, const std::vector<expr::Expr>& terms) {
    text += fmt::format("\n\ndef {}(t, state, inputs, p=PARAMETERS):\n    \"\"\"{}\"\"\"\n    [{}] = state\n", name,
                        what, names(s.states));
    if (!s.inputs.empty()) text += fmt::format("    [{}] = inputs\n", names(s.inputs));
    text += "    return [\n";
    for (const expr::Expr& e : terms)
      text += fmt::format("        {},\n", expr::print(e, expr::Notation::python, print_options));
    text += "    ]\n";
  };
  function("rates", s.discrete ? "Next states of the map." : "Derivatives of the states at time t.", s.rates);
  function("outputs", "Outputs.", s.output_terms);
  return {{o.prefix + ".py", text}};
}

std::vector<SourceFile> export_python(const ControllerDesign& design, const CodeOptions& o) {
  const ControllerCode code = controller_code(design, o);
  TemplateSettings s = wrapper_settings(design, o);
  s.slots["ctype"] = o.single_precision ? "c_float" : "c_double";
  std::string& lines = s.slots["parameters"];
  for (const CodeParameter& p : code.parameters) {
    lines += fmt::format("{}    \"{}\": {},  # {}, {}", lines.empty() ? "" : "\n", p.name,
                         expr::number_text(p.value, true), p.unit, p.meaning);
  }
  return with_source(code, {o.prefix + ".py", fill_template(deploy_template("controller.py"), s)});
}

std::vector<SourceFile> export_modelica(const IdentifiedModel& model, const CodeOptions& o) {
  require_prefix(o.prefix);
  const ModelSystem s = with_names_for(Language::modelica, model_system(model));
  std::string name = o.prefix;
  name[0] = upper(name.substr(0, 1))[0];
  std::string text = fmt::format("model {} \"{}\"\n  // {}\n", name, quoted_text(s.title), made_by(o));
  const auto declare = [&](const char* kind, const std::string& n, const std::string& unit, const std::string& more,
                           const std::string& meaning) {
    std::string attributes = unit == "1" ? "" : fmt::format("unit=\"{}\"", modelica_unit(unit));
    if (!more.empty() && more.front() != ' ') attributes += (attributes.empty() ? "" : ", ") + more;
    text += fmt::format("  {} {}{}{} \"{}\";\n", kind, n, attributes.empty() ? "" : "(" + attributes + ")",
                        !more.empty() && more.front() == ' ' ? more : "", quoted_text(meaning));
  };
  // Connectors, so that a diagram can be drawn; compatible with those of Modelica.Blocks.Interfaces.
  if (!s.inputs.empty()) text += "  connector RealInput = input Real \"input signal\";\n";
  text += "  connector RealOutput = output Real \"output signal\";\n";
  for (const CodeParameter& p : s.parameters)
    declare("parameter Real", p.name, p.unit, " = " + expr::number_text(p.value), p.meaning);
  for (const SystemVariable& v : s.inputs) declare("RealInput", v.name, v.unit, "", v.meaning);
  for (const SystemVariable& v : s.states)
    declare(s.discrete ? "discrete Real" : "Real", v.name, v.unit, "start=0, fixed=true", v.meaning);
  for (const SystemVariable& v : s.outputs) declare("RealOutput", v.name, v.unit, "", v.meaning);
  expr::PrintOptions print_options;
  print_options.name = [&s](std::string_view n) {
    if (n == "t") return std::string("time");
    const bool state =
        std::any_of(s.states.begin(), s.states.end(), [&](const SystemVariable& v) { return v.name == n; });
    return s.discrete && state ? "pre(" + std::string(n) + ")" : std::string(n);
  };
  text += "equation\n";
  if (s.discrete) text += fmt::format("  when sample(0, {}) then\n", expr::number_text(s.sample_time));
  for (std::size_t i = 0; i < s.rates.size(); ++i) {
    text += s.discrete ? fmt::format("    {} = {};\n", s.states[i].name,
                                     expr::print(s.rates[i], expr::Notation::modelica, print_options))
                       : fmt::format("  der({}) = {};\n", s.states[i].name,
                                     expr::print(s.rates[i], expr::Notation::modelica, print_options));
  }
  if (s.discrete) text += "  end when;\n";
  for (std::size_t i = 0; i < s.outputs.size(); ++i) {
    expr::PrintOptions plain;
    plain.name = [](std::string_view n) { return n == "t" ? std::string("time") : std::string(n); };
    text +=
        fmt::format("  {} = {};\n", s.outputs[i].name, expr::print(s.output_terms[i], expr::Notation::modelica, plain));
  }
  return {{name + ".mo", text + fmt::format("end {};\n", name)}};
}

std::vector<SourceFile> export_sfunction(const ControllerDesign& design, const CodeOptions& o) {
  return with_source(controller_code(design, o), {o.prefix + "_sfun.c", fill_template(deploy_template("sfunction.c"),
                                                                                      wrapper_settings(design, o))});
}

std::vector<SourceFile> export_sfunction(const IdentifiedModel& model, const CodeOptions& o) {
  if (o.single_precision) throw Error("continuous states of Simulink have double precision: leave out --float");
  const ModelSystem system = model_system(model);
  if (system.discrete)
    throw Error("the model is a map from sample to sample: it has no continuous states, export c instead");
  const ModelCode code = model_code(system, o);
  TemplateSettings s;
  s.prefix = o.prefix;
  s.slots["prefix"] = o.prefix;
  s.slots["inputs"] = system.inputs.empty() ? "none" : names(system.inputs);
  s.slots["states"] = names(system.states);
  s.slots["outputs"] = names(system.outputs);
  return {code.header, code.source, {o.prefix + "_sfun.c", fill_template(deploy_template("sfunction.c"), s)}};
}

}  // namespace whirl::deploy
