#include "whirl/response/periodic_system.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "whirl/core/error.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;
using expr::Expr;

std::map<std::string, Expr, std::less<>> right_hand_sides(const IdentifiedModel& model) {
  std::map<std::string, Expr, std::less<>> rates;
  for (const Equation& e : model.equations) {
    if (!e.lhs.ends_with("'"))
      throw Error("equation of " + e.lhs + ": a response curve needs differential equations, not a map");
    std::vector<Expr> terms;
    for (const EquationTerm& t : e.terms) terms.push_back(Expr(t.coefficient.value) * Expr::parse(t.function));
    rates.insert_or_assign(e.lhs.substr(0, e.lhs.size() - 1), Expr::sum(terms));
  }
  const auto listed = [&](const std::string& s) {
    return std::find(model.states.begin(), model.states.end(), s) != model.states.end();
  };
  for (const auto& [position, velocity] : {std::pair{"X1", "X2"}, {"X3", "X4"}})
    if (rates.count(position) == 0 && rates.count(velocity) > 0 && (listed(position) || model.states.empty()))
      rates.insert_or_assign(position, Expr::symbol(velocity));
  return rates;
}

using Expressions = std::map<std::string, Expr, std::less<>>;

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Position -> velocity. A chain x' = v, v' = a is of order 2; the coordinate is never itself a velocity.
std::map<std::string, std::string, std::less<>> velocities_of(const Expressions& rates) {
  std::map<std::string, std::string, std::less<>> velocity_of;
  std::vector<std::string> taken;
  for (const auto& [state, rate] : rates) {
    if (rate.kind() != Expr::Kind::symbol || rate.name() == state || rates.count(rate.name()) == 0) continue;
    if (contains(taken, rate.name())) continue;
    velocity_of[state] = rate.name();
    taken.push_back(rate.name());
  }
  return velocity_of;
}

/// Names in `f` that are none of `states`, each once.
std::vector<std::string> free_names(const std::vector<Expr>& f, const std::vector<std::string>& states) {
  std::vector<std::string> used;
  for (const Expr& e : f)
    for (const std::string& name : expr::variables(e))
      if (!contains(states, name) && !contains(used, name)) used.push_back(name);
  return used;
}

/// What each free name stands for: force, angle, speed; other inputs rest.
Expressions meanings(const std::vector<std::string>& used, const Forcing& forcing) {
  const Expr tau = Expr::symbol("_tau"), omega = Expr::symbol("_omega"), force = Expr::symbol("_force");
  const bool turning = forcing.turning();
  Expressions given;
  for (const std::string& name : used) {
    if (name == forcing.input) {
      given.insert_or_assign(name, force * cos(tau));
    } else if (name == "X5") {
      given.insert_or_assign(name, turning ? tau : Expr(0.0));
    } else if (name == "X6") {
      given.insert_or_assign(name, turning ? omega : Expr(0.0));
    } else if (name == "t") {
      throw Error("a term of the model uses time t: such a model has no steady response");
    } else {
      given.insert_or_assign(name, Expr(0.0));
    }
  }
  if (!forcing.input.empty() && !contains(used, forcing.input)) {
    std::string names;
    for (const std::string& name : used) names += (names.empty() ? "" : ", ") + name;
    throw Error::in_field("input", forcing.input,
                          "one of those the equations use: " + (names.empty() ? "none" : names));
  }
  return given;
}

/// Index of the coordinate along which the support moves: one with an acceleration.
std::size_t moved_by_support(const std::string& base, const std::vector<std::string>& names,
                             const std::vector<int>& order) {
  std::string allowed;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (order[i] != 2) continue;
    if (names[i] == base) return i;
    allowed += (allowed.empty() ? "" : ", ") + names[i];
  }
  throw Error::in_field("base", base, allowed.empty() ? "none: no equation is an acceleration" : "one of: " + allowed);
}

/// The terms of the angle are the unbalance: scaled as a whole. Others may know the speed too (gyroscopic term).
Expr with_unbalance(const Expr& e, const Expr& scale) {
  const std::vector<Expr> terms = e.kind() == Expr::Kind::sum ? e.args() : std::vector<Expr>{e};
  std::vector<Expr> scaled;
  for (const Expr& t : terms) scaled.push_back(contains(expr::variables(t), "X5") ? scale * t : t);
  return Expr::sum(scaled);
}

}  // namespace

PeriodicSystem::PeriodicSystem(const IdentifiedModel& model, const Forcing& forcing) : amplitude_(forcing.amplitude) {
  const auto rates = right_hand_sides(model);
  if (rates.empty()) throw Error("the model has no equation");
  const auto velocity_of = velocities_of(rates);
  std::vector<std::string> taken;
  for (const auto& [position, velocity] : velocity_of) taken.push_back(velocity);
  std::vector<std::string> velocity_names;
  std::vector<Expr> f;
  for (const auto& [state, rate] : rates) {
    if (contains(taken, state)) continue;
    names_.push_back(state);
    const auto v = velocity_of.find(state);
    order_.push_back(v == velocity_of.end() ? 1 : 2);
    velocity_names.push_back(v == velocity_of.end() ? "_rate_of_" + state : v->second);
    f.push_back(v == velocity_of.end() ? rate : rates.at(v->second));
  }
  std::vector<std::string> variables = names_;
  variables.insert(variables.end(), velocity_names.begin(), velocity_names.end());
  const std::vector<std::string> used = free_names(f, variables);
  const bool turning = forcing.turning();
  angle_ = turning && contains(used, "X5");
  const Expressions given = meanings(used, forcing);
  for (Expr& e : f) {
    if (turning && (forcing.unbalance_scale != 1 || forcing.free_unbalance)) {
      const Expr scale(forcing.unbalance_scale);
      e = with_unbalance(e, forcing.free_unbalance ? scale * Expr::symbol("_force") : scale);
    }
    e = substitute(e, given);
  }
  if (!forcing.base.empty()) {
    Expr& moved = f[moved_by_support(forcing.base, names_, order_)];
    moved = moved + Expr::symbol("_force") * pow(Expr::symbol("_omega"), 2.0) * cos(Expr::symbol("_tau"));
  }
  variables.insert(variables.end(), {"_tau", "_omega", "_force"});
  std::vector<Expr> entries = f;
  for (const Expr& e : f)
    for (const std::string& q : names_) entries.push_back(differentiate(e, q));
  for (const Expr& e : f)
    for (const std::string& v : velocity_names) entries.push_back(differentiate(e, v));
  for (const char* parameter : {"_omega", "_force"})
    for (const Expr& e : f) entries.push_back(differentiate(e, parameter));
  if (std::ranges::all_of(entries, [](const Expr& e) { return e.is_number(0); }))
    throw Error("every equation of the model is zero");
  const std::size_t n = f.size();
  const auto compiled = [&](std::size_t from, std::size_t to) {
    Compiled part;
    part.places.resize(entries.size());
    std::vector<Expr> outputs;
    for (std::size_t k = from; k < to; ++k) {
      if (entries[k].is_number()) {
        part.places[k].constant = entries[k].value();
      } else {
        part.places[k].column = static_cast<int>(outputs.size());
        outputs.push_back(entries[k]);
      }
    }
    part.tape = expr::compile(outputs, variables);
    return part;
  };
  parts_ = {compiled(0, n), compiled(n, n + 2 * n * n), compiled(0, entries.size())};
}

PeriodicSystem::Values PeriodicSystem::evaluate(Part part, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                                                const Eigen::VectorXd& tau, double omega, double force) const {
  const Index n = size(), points = tau.size();
  const Compiled& compiled = parts_[static_cast<std::size_t>(part)];
  Values values;
  values.places_ = &compiled.places;
  values.size_ = n;
  values.samples_.resize(points, static_cast<Index>(compiled.tape.n_outputs()));
  if (values.samples_.cols() == 0) return values;
  Eigen::MatrixXd in(points, 2 * n + 3);
  in.leftCols(n) = q;
  in.middleCols(n, n) = v;
  in.col(2 * n) = tau;
  in.col(2 * n + 1).setConstant(omega);
  in.col(2 * n + 2).setConstant(force);
  compiled.tape.evaluate(in, values.samples_);
  return values;
}

IdentifiedModel rotor_equations(const RotorModel& m) {
  IdentifiedModel model;
  model.states = {"X1", "X2", "X3", "X4"};
  model.inputs = {"X5", "X6"};
  const auto equation = [&](std::string lhs, std::vector<std::pair<std::string, double>> terms) {
    Equation e{std::move(lhs), {}};
    for (auto& [function, value] : terms)
      if (value != 0) e.terms.push_back({std::move(function), {value, 0, value, value}, ""});
    model.equations.push_back(std::move(e));
  };
  const double kr = m.k1_conj.real(), ki = m.k1_conj.imag(), cr = m.c_conj.real(), ci = m.c_conj.imag();
  const double er = m.eps.real(), ei = m.eps.imag();
  equation("X2'", {{"X1", -m.k1 - kr},
                   {"X3", -ki},
                   {"X2", -m.c - cr},
                   {"X4", -ci},
                   {"X1^3+X1*X3^2", -m.k2},
                   {"X6^2*cos(X5)", er},
                   {"X6^2*sin(X5)", -ei}});
  equation("X4'", {{"X3", -m.k1 + kr},
                   {"X1", -ki},
                   {"X4", -m.c + cr},
                   {"X2", -ci},
                   {"X3^3+X1^2*X3", -m.k2},
                   {"X6^2*sin(X5)", er},
                   {"X6^2*cos(X5)", ei}});
  return model;
}

}  // namespace whirl::response
