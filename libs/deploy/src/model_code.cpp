#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "fmu_description.hpp"
#include "template.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/system.hpp"
#include "whirl/expr/tape.hpp"
#include "written.hpp"

namespace whirl::deploy {
namespace {

/// Symbols of a system and their C text, in the order of the tape's variables.
struct Symbols {
  std::vector<std::string> names, text;
  explicit Symbols(const ModelSystem& s) {
    const auto add = [&](const std::string& name, std::string c) {
      names.push_back(name);
      text.push_back(std::move(c));
    };
    for (std::size_t i = 0; i < s.states.size(); ++i) add(s.states[i].name, fmt::format("x[{}]", i));
    for (std::size_t i = 0; i < s.inputs.size(); ++i) add(s.inputs[i].name, fmt::format("u[{}]", i));
    add("t", "t");
    for (const CodeParameter& p : s.parameters) add(p.name, "p->" + p.name);
    for (std::size_t i = 0; i < s.events.size(); ++i) add(fmt::format("sign_{}", i + 1), fmt::format("s[{}]", i));
    for (std::size_t i = 0; i < s.states.size(); ++i) add("change_of_" + s.states[i].name, fmt::format("dx[{}]", i));
    for (std::size_t i = 0; i < s.inputs.size(); ++i) add("change_of_" + s.inputs[i].name, fmt::format("du[{}]", i));
  }
};

/// Body of a function that computes `terms`; parameters of the function that it does not use are cast to void.
std::string body(const ModelSystem& s, const std::vector<expr::Expr>& terms, const std::vector<std::string>& targets,
                 std::initializer_list<const char*> arguments) {
  const Symbols symbols(s);
  const expr::Tape tape = expr::compile(terms, symbols.names);
  expr::Tape::C99Options options;
  options.type = "whirl_real";
  options.literal_macro = "R";
  options.function_macro = "M";
  options.inputs = symbols.text;
  options.outputs = targets;
  std::string text = tape.c99(options);
  std::string unused;
  for (const char* argument : arguments) {
    const std::string a = argument;
    const bool scalar = a == "t";
    bool used = false;
    for (const expr::Expr& e : terms) {
      for (const std::string& v : expr::variables(e)) {
        const auto at =
            static_cast<std::size_t>(std::find(symbols.names.begin(), symbols.names.end(), v) - symbols.names.begin());
        const std::string& c = symbols.text[at];
        used = used || (scalar ? c == a : c.starts_with(a + "[") || c.starts_with(a + "->"));
      }
    }
    if (!used) unused += fmt::format("  (void){};\n", a);
  }
  text = unused + text;
  if (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

/// target[0], target[1], ...
std::vector<std::string> elements(const char* target, std::size_t count) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(fmt::format("{}[{}]", target, i));
  return out;
}

std::string body(const ModelSystem& s, const std::vector<expr::Expr>& terms, const char* target,
                 std::initializer_list<const char*> arguments) {
  return body(s, terms, elements(target, terms.size()), arguments);
}

/// The angle goes on with the speed: index of an input, or none.
std::optional<std::size_t> input_index(const ModelSystem& s, std::string_view a, std::string_view b) {
  for (std::size_t i = 0; i < s.inputs.size(); ++i) {
    if (s.inputs[i].name == a || s.inputs[i].name == b) return i;
  }
  return std::nullopt;
}

/// C of each angle input after a time, empty for an input that is held: u[0] + (tau * ...).
std::vector<std::string> later_terms(const ModelSystem& s, const std::string& u, const std::string& tau) {
  const auto beta = input_index(s, "beta", "X5"), omega = input_index(s, "omega", "X6"),
             alpha = input_index(s, "alpha", "X7");
  std::vector<std::string> out(s.inputs.size());
  if (omega && alpha) out[*omega] = fmt::format("{0}[{1}] + ({2} * {0}[{3}])", u, *omega, tau, *alpha);
  if (beta && omega) {
    out[*beta] =
        alpha ? fmt::format("{0}[{1}] + ({2} * ({0}[{3}] + (R(0.5) * {2} * {0}[{4}])))", u, *beta, tau, *omega, *alpha)
              : fmt::format("{0}[{1}] + ({2} * {0}[{3}])", u, *beta, tau, *omega);
  }
  return out;
}

std::string later_inputs(const ModelSystem& s) {
  if (s.inputs.empty()) return "  (void)tau;\n  (void)u;\n  later[0] = R(0.0);";
  std::string out;
  bool uses_tau = false;
  const std::vector<std::string> terms = later_terms(s, "u", "tau");
  for (std::size_t i = 0; i < terms.size(); ++i) {
    uses_tau = uses_tau || !terms[i].empty();
    out += fmt::format("{}  later[{}] = {};", out.empty() ? "" : "\n", i,
                       terms[i].empty() ? fmt::format("u[{}]", i) : terms[i]);
  }
  return (uses_tau ? "" : "  (void)tau;\n") + out;
}

std::string sizes(const ModelSystem& s) {
  std::string out = fmt::format(
      "#define WHIRL_STATES {}\n#define WHIRL_INPUTS {}\n#define WHIRL_INPUT_SIZE {} /* of an array */\n"
      "#define WHIRL_OUTPUTS {}\n",
      s.states.size(), s.inputs.size(), std::max<std::size_t>(1, s.inputs.size()), s.outputs.size());
  if (!s.events.empty()) out += fmt::format("#define WHIRL_EVENTS {}\n", s.events.size());
  const auto list = [&](const char* array, const std::vector<SystemVariable>& all) {
    out += fmt::format("\n/* {}", array);
    for (std::size_t i = 0; i < all.size(); ++i) {
      out += fmt::format("{}[{}] {}, {}: {}", i == 0 ? ": " : "\n      ", i, all[i].name, c_comment(all[i].unit),
                         c_comment(all[i].meaning));
    }
    out += all.empty() ? ": none */" : " */";
  };
  list("x", s.states);
  list("u", s.inputs);
  list("y", s.outputs);
  return out;
}

std::string rate_comment(const ModelSystem& s) {
  std::string out;
  for (std::size_t i = 0; i < s.states.size(); ++i) {
    out += fmt::format("\n     {}{} = {}", s.states[i].name, s.discrete ? "[k+1]" : "'", c_comment(s.rates[i].str()));
  }
  return out;
}

TemplateSettings settings_of(const ModelSystem& s, const CodeOptions& options) {
  require_prefix(options.prefix);
  TemplateSettings t;
  t.prefix = options.prefix;
  t.single_precision = options.single_precision;
  if (s.discrete) t.features.insert("MAP");
  if (!s.events.empty() && !s.discrete) t.features.insert("EVENTS");
  auto& slot = t.slots;
  slot["prefix"] = options.prefix;
  slot["real"] = options.single_precision ? "float" : "double";
  slot["banner"] = fmt::format(
      "/* {}: {}\n{}\n\n   Made by whirl {}{}.\n   SI units throughout. C99, no allocation, no input or output, no "
      "globals. */",
      options.prefix, c_comment(s.title), rate_comment(s), version(),
      options.origin.empty() ? "" : "\n   from " + c_comment(options.origin));
  slot["parameters"] = "";
  slot["defaults"] = "";
  for (const CodeParameter& p : s.parameters) {
    slot["parameters"] += fmt::format("{}  whirl_real {}; /* {}, {} */", slot["parameters"].empty() ? "" : "\n", p.name,
                                      c_comment(p.unit), c_comment(p.meaning));
    slot["defaults"] += fmt::format("{}  params->{} = {};", slot["defaults"].empty() ? "" : "\n", p.name,
                                    c_literal(p.value, options.single_precision));
  }
  if (s.parameters.empty()) throw Error("the model has no coefficients");
  slot["sizes"] = sizes(s);
  slot["held"] = input_index(s, "omega", "X6") ? "; the angle goes on with the speed, other inputs are held" : " held";
  slot["later"] = later_inputs(s);
  slot["rates"] = body(s, s.rates, "dx", {"p", "t", "x", "u"});
  slot["outputs"] = body(s, s.output_terms, "y", {"p", "t", "x", "u"});
  if (t.features.contains("EVENTS")) {
    std::vector<expr::Expr> frozen;
    for (const expr::Expr& e : s.rates) frozen.push_back(with_frozen_signs(e, s.events));
    slot["frozen"] = body(s, frozen, "dx", {"p", "t", "x", "u", "s"});
    slot["events"] = body(s, s.events, "z", {"p", "t", "x", "u"});
  }
  return t;
}

}  // namespace

std::string angle_lines(const ModelSystem& system) {
  std::string out;
  const std::vector<std::string> terms = later_terms(system, "c->input", "age");
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (!terms[i].empty()) out += fmt::format("{}    u[{}] = {};", out.empty() ? "" : "\n", i, terms[i]);
  }
  return out.empty() ? "    (void)age;" : out;
}

std::string along_lines(const ModelSystem& s, const CodeOptions& options) {
  std::vector<expr::Expr> changes;
  const auto add = [&](const expr::Expr& term) {
    const expr::Expr smooth = with_frozen_signs(term, s.events);
    std::vector<expr::Expr> parts;
    for (const auto& list : {s.states, s.inputs}) {
      for (const SystemVariable& v : list)
        parts.push_back(expr::differentiate(smooth, v.name) * expr::Expr::symbol("change_of_" + v.name));
    }
    changes.push_back(expr::Expr::sum(parts));
  };
  for (const expr::Expr& e : s.rates) add(e);
  for (const expr::Expr& e : s.output_terms) add(e);
  std::vector<std::string> targets = elements("rate", s.rates.size());
  for (const std::string& name : elements("output", s.output_terms.size())) targets.push_back(name);
  TemplateSettings t;
  t.prefix = options.prefix;
  return fill_template(s.events.empty() ? body(s, changes, targets, {"p", "t", "x", "u", "dx", "du"})
                                        : body(s, changes, targets, {"p", "t", "x", "u", "s", "dx", "du"}),
                       t);
}

ModelCode model_code(const ModelSystem& system, const CodeOptions& options) {
  const TemplateSettings t = settings_of(system, options);
  return {{options.prefix + ".h", fill_template(deploy_template("model.h"), t)},
          {options.prefix + ".c", fill_template(deploy_template("model.c"), t)}};
}

std::vector<SourceFile> export_c99(const IdentifiedModel& model, const CodeOptions& options) {
  const ModelSystem s = model_system(model);
  const ModelCode code = model_code(s, options);
  TemplateSettings t;
  t.prefix = options.prefix;
  t.single_precision = options.single_precision;
  t.slots["prefix"] = options.prefix;
  constexpr int kPoints = 40;
  t.slots["points"] = std::to_string(kPoints);
  t.slots["tolerance"] = options.single_precision ? "1e-4" : "1e-12";

  // Points of the size the quantities have; the numbers come from the tape, not from C.
  const Symbols symbols(s);
  const expr::Tape tape = expr::compile(s.rates, symbols.names);
  std::vector<double> in(symbols.names.size()), out(s.states.size());
  const std::size_t n = s.states.size(), m = s.inputs.size();
  for (std::size_t i = 0; i < s.parameters.size(); ++i) {
    const double value = s.parameters[i].value;
    in[n + m + 1 + i] = options.single_precision ? static_cast<double>(static_cast<float>(value)) : value;
  }
  std::mt19937_64 random(1);
  const auto size_of = [](const SystemVariable& v) {
    return v.unit == "m" ? 1e-3 : v.unit == "m/s" ? 0.1 : v.unit == "rad/s" ? 150 : 2.0;
  };
  const auto draw = [&](double size) {
    const double value = size * (2 * static_cast<double>(random()) / 18446744073709551616.0 - 1);
    return options.single_precision ? static_cast<double>(static_cast<float>(value)) : value;
  };
  const std::string suffix = options.single_precision ? "F" : "";
  std::string& vectors = t.slots["vectors"];
  for (int k = 0; k < kPoints; ++k) {
    for (std::size_t i = 0; i < n; ++i) in[i] = draw(size_of(s.states[i]));
    for (std::size_t i = 0; i < m; ++i) in[n + i] = draw(size_of(s.inputs[i]));
    in[n + m] = std::abs(draw(10));
    tape.evaluate_point(in.data(), out.data());
    const auto list = [&](const double* values, std::size_t count, const std::string& end) {
      std::string text;
      for (std::size_t i = 0; i < count; ++i) {
        text +=
            (i == 0 ? "" : ", ") + (std::isfinite(values[i]) ? fmt::format("{:a}{}", values[i], end) : "(double)NAN");
      }
      return text.empty() ? "0" : text;
    };
    vectors += fmt::format("{}    {{{:a}{}, {{{}}}, {{{}}}, {{{}}}}},", vectors.empty() ? "" : "\n", in[n + m], suffix,
                           list(in.data(), n, suffix), list(in.data() + n, m, suffix), list(out.data(), n, ""));
  }
  return {code.header,
          code.source,
          {options.prefix + "_selftest.c", fill_template(deploy_template("model_selftest.c"), t)},
          {"CMakeLists.txt", fill_template(deploy_template("CMakeLists.txt.in"), t)},
          {"Makefile", fill_template(deploy_template("Makefile.in"), t)}};
}

}  // namespace whirl::deploy
