#include "whirl/deploy/system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "rotor_parameters.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/expr/unit.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/identify/simulate_model.hpp"

namespace whirl::deploy {
namespace {

/// A term rebuilt with `change` applied to its functions, innermost first.
template <class Change>
expr::Expr rewrite(const expr::Expr& e, const Change& change) {
  if (e.kind() == expr::Expr::Kind::number || e.kind() == expr::Expr::Kind::symbol) return e;
  std::vector<expr::Expr> args;
  for (const expr::Expr& a : e.args()) args.push_back(rewrite(a, change));
  switch (e.kind()) {
    case expr::Expr::Kind::power:
      return pow(args[0], args[1]);
    case expr::Expr::Kind::product:
      return expr::Expr::product(args);
    case expr::Expr::Kind::sum:
      return expr::Expr::sum(args);
    default:
      return change(e.function(), args);
  }
}

std::vector<expr::Expr> find_events(const std::vector<expr::Expr>& terms) {
  std::vector<expr::Expr> events;
  for (const expr::Expr& term : terms) {
    rewrite(term, [&](expr::Function f, const std::vector<expr::Expr>& args) {
      if (f == expr::Function::sgn && std::find(events.begin(), events.end(), args[0]) == events.end())
        events.push_back(args[0]);
      return expr::Expr::call(f, args);
    });
  }
  return events;
}

/// The next power of ten; 1 for zero and what is no number.
double rounded_up(double size) {
  return size > 0 && std::isfinite(size) ? std::pow(10, std::ceil(std::log10(size))) : 1;
}

/// Whirl of a rotor above its critical speed has the size of its eccentricity.
double usual_way(const RotorModel& m) {
  const double e = std::abs(m.eps);
  return e > 1e-9 && std::isfinite(e) ? rounded_up(e) : 1e-3;
}

/// Size that a quantity of this unit has on a laboratory rotor.
double usual_size(const std::string& unit) {
  static const std::map<std::string, double> sizes{{"m", 1e-3}, {"m/s", 0.1}, {"m/s^2", 10}, {"rad/s", 100}};
  const auto found = sizes.find(unit);
  return found == sizes.end() ? 1 : found->second;
}

ModelSystem rotor_system(const RotorModel& m) {
  ModelSystem s;
  s.title = "identified rotor in the complex coordinate, z'' = -k1 z - k2 |z|^2 z - c z' + eps F + gain u";
  s.parameters = rotor_parameters(m);
  s.parameters.push_back({"gain", "1/kg", "acceleration per newton of actuator force; 0: not known, forces do nothing",
                          m.gain, -kInfinity, kInfinity});
  const double way = usual_way(m), speed = rounded_up(way * std::sqrt(std::abs(m.k1)));
  s.states = {{"x", "m", "displacement of the disk", way},
              {"vx", "m/s", "velocity", speed},
              {"y", "m", "displacement of the disk", way},
              {"vy", "m/s", "velocity", speed}};
  s.inputs = {{"beta", "rad", "rotor angle"},
              {"omega", "rad/s", "rotor speed"},
              {"alpha", "rad/s^2", "rotor acceleration"},
              {"ux", "N", "actuator force"},
              {"uy", "N", "actuator force"}};
  s.outputs = {{"x_sensor", "m", "displacement the sensors see", way},
               {"y_sensor", "m", "displacement the sensors see", way}};
  const expr::Expr fx = expr::Expr::parse("omega^2*cos(beta) + alpha*sin(beta)"),
                   fy = expr::Expr::parse("omega^2*sin(beta) - alpha*cos(beta)");
  const std::map<std::string, expr::Expr, std::less<>> forcing{{"fx", fx}, {"fy", fy}};
  const auto term = [&](const char* text) { return expr::substitute(expr::Expr::parse(text), forcing); };
  s.rates = {
      term("vx"),
      term("-(k1 + k2*(x^2 + y^2))*x - c*vx - k1_conj_re*x - k1_conj_im*y - c_conj_re*vx - c_conj_im*vy + eps_re*fx - "
           "eps_im*fy + gain*ux"),
      term("vy"),
      term("-(k1 + k2*(x^2 + y^2))*y - c*vy + k1_conj_re*y - k1_conj_im*x + c_conj_re*vy - c_conj_im*vx + eps_re*fy + "
           "eps_im*fx + gain*uy")};
  expr::Expr out_x = expr::Expr::parse("x + offset_x"), out_y = expr::Expr::parse("y + offset_y");
  for (std::size_t i = 1; i <= m.modes.size(); ++i) {
    const ForcedMode& mode = m.modes[i - 1];
    const auto name = [&](const char* stem) { return fmt::format("{}{}", stem, i); };
    const auto symbol = [&](const char* stem) { return expr::Expr::symbol(name(stem)); };
    s.parameters.push_back({name("mode_omega"), "rad/s", "undamped natural frequency of a further mode", mode.omega,
                            -kInfinity, kInfinity});
    s.parameters.push_back({name("mode_zeta"), "1", "its damping ratio", mode.zeta, -kInfinity, kInfinity});
    s.parameters.push_back(
        {name("mode_re"), "m", "its share in the displacement", mode.participation.real(), -kInfinity, kInfinity});
    s.parameters.push_back(
        {name("mode_im"), "m", "its share in the displacement", mode.participation.imag(), -kInfinity, kInfinity});
    for (const char* part : {"x", "y"}) {
      const std::string q = name("q") + part, dq = name("dq") + part;
      s.states.push_back({q, "1", "coordinate of a further mode", 1});
      s.states.push_back({dq, "1/s", "its rate", rounded_up(std::abs(mode.omega))});
      const expr::Expr w = symbol("mode_omega");
      s.rates.push_back(expr::Expr::symbol(dq));
      s.rates.push_back((*part == 'x' ? fx : fy) - expr::Expr(2) * symbol("mode_zeta") * w * expr::Expr::symbol(dq) -
                        pow(w, expr::Expr(2)) * expr::Expr::symbol(q));
    }
    const expr::Expr qx = expr::Expr::symbol(name("q") + "x"), qy = expr::Expr::symbol(name("q") + "y");
    out_x = out_x + symbol("mode_re") * qx - symbol("mode_im") * qy;
    out_y = out_y + symbol("mode_re") * qy + symbol("mode_im") * qx;
  }
  s.output_terms = {out_x, out_y};
  return s;
}

std::string unit_text(const std::string& name) {
  const auto found = expr::rotor_units().find(name);
  return found == expr::rotor_units().end() ? "1" : found->second.str();
}

const char* meaning_of(const std::string& name) {
  static const std::map<std::string, const char*> known{
      {"X1", "displacement x"},     {"X2", "velocity of x"},  {"X3", "displacement y"},
      {"X4", "velocity of y"},      {"X5", "rotor angle"},    {"X6", "rotor speed"},
      {"X7", "rotor acceleration"}, {"ux", "actuator force"}, {"uy", "actuator force"}};
  const auto found = known.find(name);
  return found == known.end() ? "quantity of the model" : found->second;
}

ModelSystem equation_system(const IdentifiedModel& model) {
  const identification::CompiledModel compiled(
      model);  // states, inputs and their order; refuses what is no system of equations
  ModelSystem s;
  s.title = fmt::format("identified equations (method {})", model.method);
  s.discrete = compiled.discrete();
  for (const std::string& name : compiled.states()) {
    const std::string unit = unit_text(name);
    s.states.push_back({name, unit, meaning_of(name), usual_size(unit)});
  }
  for (const std::string& name : compiled.inputs()) {
    if (name != "t") s.inputs.push_back({name, unit_text(name), meaning_of(name)});
  }
  for (const auto& list : {s.states, s.inputs}) {
    for (const SystemVariable& v : list) {
      if (v.name.find('\'') != std::string::npos)
        throw Error("the name " + v.name + " cannot be exported: it holds a prime");
      if (!is_identifier(v.name)) throw Error::in_field("name of the model", one_line(v.name), kIdentifierRule);
    }
  }
  std::size_t number = 0;
  for (const std::string& state : compiled.states()) {
    ++number;
    const auto equation = std::find_if(model.equations.begin(), model.equations.end(), [&](const Equation& e) {
      return e.lhs == state + "'" || e.lhs == state + "[k+1]";
    });
    if (equation == model.equations.end()) {  // X1' = X2, X3' = X4
      s.rates.push_back(expr::Expr::symbol(state == "X1" ? "X2" : "X4"));
      continue;
    }
    std::vector<expr::Expr> terms;
    for (std::size_t j = 0; j < equation->terms.size(); ++j) {
      const EquationTerm& term = equation->terms[j];
      const std::string name = fmt::format("xi_{}_{}", number, j + 1);
      s.parameters.push_back({name, term.unit.empty() ? "1" : term.unit,
                              fmt::format("{}: coefficient of {}", equation->lhs, term.function),
                              term.coefficient.value, -kInfinity, kInfinity});
      terms.push_back(expr::Expr::symbol(name) * expr::Expr::parse(term.function));
    }
    s.rates.push_back(expr::Expr::sum(terms));
  }
  for (const SystemVariable& v : s.states) {
    s.outputs.push_back({v.name + "_out", v.unit, v.meaning, v.nominal});
    s.output_terms.push_back(expr::Expr::symbol(v.name));
  }
  return s;
}

}  // namespace

std::vector<CodeParameter> rotor_parameters(const RotorModel& m) {
  std::vector<CodeParameter> out;
  const auto parameter = [&](const char* name, const char* unit, const char* meaning, double value) {
    out.push_back({name, unit, meaning, value, -kInfinity, kInfinity});
  };
  parameter("k1", "1/s^2", "linear stiffness per mass", m.k1);
  parameter("k2", "1/(m^2 s^2)", "cubic stiffness per mass", m.k2);
  parameter("c", "1/s", "damping per mass", m.c);
  parameter("k1_conj_re", "1/s^2", "anisotropic stiffness (kx - ky)/2", m.k1_conj.real());
  parameter("k1_conj_im", "1/s^2", "coupling stiffness", m.k1_conj.imag());
  parameter("c_conj_re", "1/s", "anisotropic damping", m.c_conj.real());
  parameter("c_conj_im", "1/s", "coupling damping", m.c_conj.imag());
  parameter("eps_re", "m", "unbalance e cos(phase)", m.eps.real());
  parameter("eps_im", "m", "unbalance e sin(phase)", m.eps.imag());
  parameter("offset_x", "m", "equilibrium seen by the sensors", m.offset.real());
  parameter("offset_y", "m", "equilibrium seen by the sensors", m.offset.imag());
  return out;
}

expr::Expr with_frozen_signs(const expr::Expr& e, const std::vector<expr::Expr>& events) {
  return rewrite(e, [&](expr::Function f, const std::vector<expr::Expr>& args) {
    if (f == expr::Function::sgn) {
      // `args` have their own signs frozen already, so compare with the frozen form of each event.
      for (std::size_t i = 0; i < events.size(); ++i) {
        if (args[0] == events[i] || args[0] == with_frozen_signs(events[i], events))
          return expr::Expr::symbol(fmt::format("sign_{}", i + 1));
      }
    }
    return expr::Expr::call(f, args);
  });
}

/// The forces that the records showed beyond RotorModel, each with its coefficient as a parameter.
void add_further_forces(const IdentifiedModel& model, ModelSystem& s) {
  const std::vector<identification::RotorTerm> terms = identification::terms_of(model);
  if (terms.empty()) return;
  const auto symbol = [](const char* name) { return expr::Expr::symbol(name); };
  const std::map<std::string, expr::Expr, std::less<>> names{
      {"X1", symbol("x")},    {"X2", symbol("vx")},    {"X3", symbol("y")},    {"X4", symbol("vy")},
      {"X5", symbol("beta")}, {"X6", symbol("omega")}, {"X7", symbol("alpha")}};
  for (const identification::RotorTerm& term : terms) {
    const std::string parameter(term.parameter()), unit(term.unit());
    s.parameters.push_back(
        {parameter, unit.empty() ? "1" : unit, std::string(term.entry->label), term.value, -kInfinity, kInfinity});
    for (const bool x : {true, false}) {
      expr::Expr& rate = s.rates[x ? 1 : 3];
      for (const auto& [function, sign] : identification::term_text(term, x))
        rate = rate + expr::Expr(sign) * symbol(parameter.c_str()) * substitute(expr::Expr::parse(function), names);
    }
  }
  s.title += ", with " + names_of(terms);
}

ModelSystem model_system(const IdentifiedModel& model) {
  ModelSystem s = model.rotor ? rotor_system(*model.rotor) : equation_system(model);
  if (model.rotor) add_further_forces(model, s);
  s.sample_time = model.sample_time > 0 ? model.sample_time : 1e-3;
  s.events = find_events(s.rates);
  return s;
}

}  // namespace whirl::deploy
