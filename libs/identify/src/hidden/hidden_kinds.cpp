#include "hidden/hidden_kinds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/expr/expr.hpp"

namespace whirl::identification::detail {
namespace {

Estimate sought(double value) {
  Estimate e;
  e.value = value;
  return e;
}
Estimate fixed(double value) { return {value, 0, value, value}; }

Equation* equation_of(IdentifiedModel& model, const std::string& lhs) {
  const auto at =
      std::find_if(model.equations.begin(), model.equations.end(), [&](const Equation& e) { return e.lhs == lhs; });
  return at == model.equations.end() ? nullptr : &*at;
}

bool kinematic(const Equation& e) { return e.terms.size() == 1 && e.terms[0].coefficient.sd == 0; }

/// The model with only the terms of degree one of its sought equations.
IdentifiedModel linear_part(const IdentifiedModel& model) {
  IdentifiedModel out = model;
  for (Equation& e : out.equations) {
    if (kinematic(e)) continue;
    std::erase_if(e.terms, [](const EquationTerm& t) {
      const expr::Expr f = expr::Expr::parse(t.function);
      return f.kind() != expr::Expr::Kind::symbol && !f.is_number();
    });
  }
  return out;
}

void add_state(IdentifiedModel& model, const std::string& name, std::vector<EquationTerm> terms) {
  model.states.push_back(name);
  model.equations.push_back({name + "'", std::move(terms)});
}

/// Of an open tank; the floor keeps its slope finite.
std::string outflow_of(const std::string& level) { return "sqrt(max(" + level + ",1e-6))"; }

/// `input` replaced by what leaves a store that it fills.
HiddenStart store(const IdentifiedModel& base, const std::string& input, const std::string& name, bool root,
                  double rate) {
  HiddenStart start{fmt::format("{} of {}", root ? "store" : "lag", input), base};
  const std::string outflow = root ? outflow_of(name) : name;
  const std::map<std::string, expr::Expr, std::less<>> by{{input, expr::Expr::parse(outflow)}};
  for (Equation& e : start.model.equations) {
    for (EquationTerm& t : e.terms) t.function = expr::substitute(expr::Expr::parse(t.function), by).str();
  }
  add_state(start.model, name, {{expr::Expr::parse(input + "-" + outflow).str(), sought(rate), ""}});
  return start;
}

void add_stores(std::vector<HiddenStart>& starts, const IdentifiedModel& base, const SindyOptions& options,
                const HiddenScales& scales, const std::string& name) {
  for (std::size_t k = 0; k < options.inputs.size(); ++k) {
    for (const bool root : {false, true}) {
      // About a level u^2 the outflow sqrt(h) follows with the rate a / (2 u).
      const double level = root ? 2 * scales.input_size[k] : 1;
      for (const double rate : {0.3, 1.0, 4.0})
        starts.push_back(store(base, options.inputs[k], name, root, rate * level * scales.rate));
    }
  }
}

void add_hysteresis(std::vector<HiddenStart>& starts, const IdentifiedModel& base, const HiddenScales& scales,
                    const std::string& name) {
  for (const Equation& e : base.equations) {
    if (!kinematic(e) || !e.lhs.ends_with("'")) continue;
    const std::string x = e.lhs.substr(0, e.lhs.size() - 1), v = e.terms[0].function;
    const auto at = std::find(base.states.begin(), base.states.end(), x);
    if (at == base.states.end() || std::find(base.states.begin(), base.states.end(), v) == base.states.end()) continue;
    const double size = scales.state_spread[static_cast<std::size_t>(at - base.states.begin())];
    for (const double saturation : {0.5, 1.5}) {
      HiddenStart start{"hysteresis of " + x, base};
      Equation* motion = equation_of(start.model, v + "'");
      if (motion == nullptr || kinematic(*motion)) continue;
      double stiffness = scales.rate * scales.rate;
      for (EquationTerm& t : motion->terms) {
        if (t.function != x || !(t.coefficient.value < 0)) continue;
        stiffness = 0.5 * -t.coefficient.value;
        t.coefficient = sought(-stiffness);
      }
      motion->terms.push_back({name, fixed(-1), ""});
      add_state(start.model, name,
                {{v, sought(stiffness), ""},
                 {fmt::format("abs({})*{}", v, name), sought(-0.7 / (saturation * size)), ""},
                 {fmt::format("{}*abs({})", v, name), sought(-0.1 / (saturation * size)), ""}});
      starts.push_back(std::move(start));
    }
  }
}

void add_memory(std::vector<HiddenStart>& starts, const IdentifiedModel& base, const SindyOptions& options,
                const HiddenScales& scales, const std::string& name) {
  for (const Equation& e : base.equations) {
    if (kinematic(e) || std::none_of(options.states.begin(), options.states.end(),
                                     [&](const std::string& s) { return e.lhs == s + "'" || e.lhs == s + "''"; }))
      continue;
    const std::string state = e.lhs.substr(0, e.lhs.size() - 1);
    for (const double rate : {0.2, 2.0}) {
      HiddenStart start{"memory in " + e.lhs, base};
      const double a = rate * scales.rate;
      equation_of(start.model, e.lhs)->terms.push_back({name, fixed(1), ""});
      std::vector<EquationTerm> terms{{name, sought(-a), ""}, {state, sought(-0.3 * a * scales.rate), ""}};
      for (const std::string& input : options.inputs) terms.push_back({input, sought(0), ""});
      add_state(start.model, name, std::move(terms));
      starts.push_back(std::move(start));
    }
  }
}

}  // namespace

std::vector<HiddenStart> hidden_starts(const IdentifiedModel& model, const SindyOptions& options,
                                       const HiddenScales& scales, const std::string& name) {
  std::vector<HiddenStart> starts;
  std::vector<IdentifiedModel> bases{model};
  const IdentifiedModel linear = linear_part(model);
  const auto terms = [](const IdentifiedModel& m) {
    std::size_t n = 0;
    for (const Equation& e : m.equations) n += e.terms.size();
    return n;
  };
  if (terms(linear) < terms(model)) bases.push_back(linear);
  for (const IdentifiedModel& base : bases) {
    add_stores(starts, base, options, scales, name);
    add_hysteresis(starts, base, scales, name);
    add_memory(starts, base, options, scales, name);
  }
  return starts;
}

std::vector<Equation> hidden_candidates(const IdentifiedModel& model, const SindyOptions& options,
                                        const std::map<std::string, std::vector<double>>& levels) {
  std::vector<std::string> variables = options.states;
  if (options.order == 2) {
    for (const std::string& s : options.states) variables.push_back(s + "'");
  }
  std::vector<std::string> hidden;
  for (const std::string& s : model.states) {
    if (std::find(variables.begin(), variables.end(), s) == variables.end()) hidden.push_back(s);
  }
  std::vector<Equation> out;
  for (const Equation& e : model.equations) {
    if (kinematic(e)) continue;
    const std::string state = e.lhs.substr(0, e.lhs.size() - 1);
    const bool own = std::find(hidden.begin(), hidden.end(), state) != hidden.end();
    std::vector<std::string> texts = options.library;
    if (own || texts.empty()) texts.insert(texts.end(), {"1"});
    for (const std::vector<std::string>* names :
         std::initializer_list<const std::vector<std::string>*>{&variables, &options.inputs, &hidden}) {
      for (const std::string& v : *names) {
        texts.push_back(v);
        if (own || texts.empty()) texts.push_back(v + "^2");
      }
    }
    for (const std::string& h : hidden) {
      texts.push_back(outflow_of(h));
      texts.push_back(h + "^2");
      texts.push_back(h + "^3");
      if (const auto at = levels.find(h); at != levels.end()) {
        for (const double level : at->second) texts.push_back(fmt::format("max({}-({:.4g}),0)", h, level));
      }
      for (const std::string& v : variables) {
        texts.push_back(h + "*" + v);
        if (own) {
          texts.push_back("abs(" + v + ")*" + h);
          texts.push_back(v + "*abs(" + h + ")");
        }
      }
    }
    Equation candidates{e.lhs, {}};
    std::vector<expr::Expr> seen;
    for (const EquationTerm& t : e.terms) seen.push_back(expr::Expr::parse(t.function));
    for (const std::string& text : texts) {
      const expr::Expr f = expr::split_coefficient(expr::Expr::parse(text)).second;
      if (std::find(seen.begin(), seen.end(), f) != seen.end()) continue;
      seen.push_back(f);
      candidates.terms.push_back({f.str(), sought(0), ""});
    }
    out.push_back(std::move(candidates));
  }
  return out;
}

}  // namespace whirl::identification::detail
