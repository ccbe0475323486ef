#include "algebra.hpp"

#include <fmt/format.h>

#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::lagrange::algebra {
namespace {

// |x| and sgn x of real arguments, with derivatives that stay inside this pair (GiNaC's own are complex).
ex magnitude_eval(const ex& x);
ex sign_eval(const ex& x);
ex magnitude_derivative(const ex& x, unsigned);
ex sign_derivative(const ex&, unsigned) { return 0; }

DECLARE_FUNCTION_1P(magnitude)
DECLARE_FUNCTION_1P(sign)
REGISTER_FUNCTION(magnitude, eval_func(magnitude_eval).derivative_func(magnitude_derivative))
REGISTER_FUNCTION(sign, eval_func(sign_eval).derivative_func(sign_derivative))

ex magnitude_eval(const ex& x) { return GiNaC::is_a<GiNaC::numeric>(x) ? ex(GiNaC::abs(x)) : magnitude(x).hold(); }
ex sign_eval(const ex& x) { return GiNaC::is_a<GiNaC::numeric>(x) ? ex(GiNaC::csgn(x)) : sign(x).hold(); }
ex magnitude_derivative(const ex& x, unsigned) { return sign(x); }

/// The fraction with a small denominator that is this double, else the exact binary fraction: K/3 stays a third.
GiNaC::numeric rational(double value) {
  double rest = std::abs(value), p0 = 0, q0 = 1, p1 = 1, q1 = 0;
  for (int i = 0; i < 20; ++i) {
    const double whole = std::floor(rest), p = whole * p1 + p0, q = whole * q1 + q0;
    if (q > 1e6 || p > 1e15) break;
    p0 = p1, q0 = q1, p1 = p, q1 = q;
    if (p / q == std::abs(value)) {
      return GiNaC::numeric(static_cast<long>(std::copysign(p, value))) / GiNaC::numeric(static_cast<long>(q));
    }
    if (rest == whole) break;
    rest = 1 / (rest - whole);
  }
  int exponent = 0;
  const long mantissa = static_cast<long>(std::ldexp(std::frexp(value, &exponent), 53));
  return GiNaC::numeric(mantissa) * GiNaC::pow(GiNaC::numeric(2), GiNaC::numeric(exponent - 53));
}

expr::Expr function_back(const std::string& name, const expr::Expr& x) {
  for (const expr::Function f : {expr::Function::exp, expr::Function::log, expr::Function::sin, expr::Function::cos,
                                 expr::Function::tan, expr::Function::tanh}) {
    if (name == to_string(f)) return expr::Expr::call(f, {x});
  }
  if (name == "magnitude") return abs(x);
  if (name == "sign") return sgn(x);
  throw Error("the computer algebra gave a function that terms do not have: " + name);
}

}  // namespace

symbol Names::declare(const std::string& name, Kind kind) {
  if (name.empty() || expr::Expr::parse(name).kind() != expr::Expr::Kind::symbol)
    throw Error("name '" + name + "': must be letters, digits and primes");
  if (has(name)) throw Error("name '" + name + "' is declared twice");
  const GiNaC::realsymbol s(name);
  symbols_.emplace(name, std::pair<symbol, Kind>{s, kind});
  return s;
}

ex Names::at(const std::string& name) const {
  const auto it = symbols_.find(name);
  if (it != symbols_.end()) return it->second.first;
  std::string list;
  for (const auto& [declared, unused] : symbols_) list += " " + declared;
  throw Error(fmt::format("name '{}' is not declared; declared are{}", name, list));
}

namespace {

/// Summands once every product and whole power of sums is multiplied out.
double expanded_size(const expr::Expr& e) {
  double size = e.kind() == expr::Expr::Kind::sum ? 0 : 1;
  for (const expr::Expr& arg : e.args()) {
    const double part = expanded_size(arg);
    if (e.kind() == expr::Expr::Kind::sum)
      size += part;
    else
      size *= part;
  }
  if (e.kind() == expr::Expr::Kind::function && size <= 1000) return 1;  // an argument stays one factor
  if (e.kind() != expr::Expr::Kind::power || !e.args()[1].is_number()) return size;
  // (k summands)^n has (k + n - 1 choose n).
  const double k = expanded_size(e.args()[0]), n = std::abs(e.args()[1].value());
  return std::exp(std::lgamma(k + n) - std::lgamma(n + 1) - std::lgamma(k));
}

}  // namespace

ex Names::read(const std::string& text, const char* what) const {
  if (text.empty()) return 0;
  try {
    const expr::Expr term = expr::Expr::parse(text);
    if (!(expanded_size(term) <= 20000)) throw Error("has more than 20000 summands when multiplied out");
    return from(term);
  } catch (const Error& e) {
    throw Error(fmt::format("{} '{}': {}", what, text, e.what()));
  }
}

ex Names::from(const expr::Expr& e) const {
  const auto arg = [&](std::size_t i) { return from(e.args()[i]); };
  switch (e.kind()) {
    case expr::Expr::Kind::number:
      return rational(e.value());
    case expr::Expr::Kind::symbol:
      return at(e.name());
    case expr::Expr::Kind::power:
      return GiNaC::pow(arg(0), arg(1));
    case expr::Expr::Kind::sum:
    case expr::Expr::Kind::product: {
      ex result = e.kind() == expr::Expr::Kind::sum ? 0 : 1;
      for (const expr::Expr& part : e.args()) {
        if (e.kind() == expr::Expr::Kind::sum)
          result += from(part);
        else
          result *= from(part);
      }
      return result;
    }
    case expr::Expr::Kind::function:
      break;
  }
  switch (e.function()) {
    case expr::Function::abs:
      return magnitude(arg(0));
    case expr::Function::sgn:
      return sign(arg(0));
    case expr::Function::exp:
      return GiNaC::exp(arg(0));
    case expr::Function::log:
      return GiNaC::log(arg(0));
    case expr::Function::sin:
      return GiNaC::sin(arg(0));
    case expr::Function::cos:
      return GiNaC::cos(arg(0));
    case expr::Function::tan:
      return GiNaC::tan(arg(0));
    case expr::Function::tanh:
      return GiNaC::tanh(arg(0));
    case expr::Function::min:
      return (arg(0) + arg(1) - magnitude(arg(0) - arg(1))) / 2;
    case expr::Function::max:
      return (arg(0) + arg(1) + magnitude(arg(0) - arg(1))) / 2;
  }
  return 0;
}

expr::Expr Names::to(const ex& e) const {
  if (GiNaC::is_a<GiNaC::numeric>(e)) {
    const GiNaC::numeric n = GiNaC::ex_to<GiNaC::numeric>(e);
    // A quotient of two doubles is rounded once, which is what the text of a fraction means.
    if (n.is_rational() && GiNaC::abs(n.numer()) < GiNaC::numeric(1L << 53) && n.denom() < GiNaC::numeric(1L << 53)) {
      return n.numer().to_double() / n.denom().to_double();
    }
    return n.to_double();
  }
  if (GiNaC::is_a<symbol>(e)) return expr::Expr::symbol(GiNaC::ex_to<symbol>(e).get_name());
  std::vector<expr::Expr> args;
  for (std::size_t i = 0; i < e.nops(); ++i) args.push_back(to(e.op(i)));
  if (GiNaC::is_a<GiNaC::add>(e)) return expr::Expr::sum(std::move(args));
  if (GiNaC::is_a<GiNaC::mul>(e)) return expr::Expr::product(std::move(args));
  if (GiNaC::is_a<GiNaC::power>(e)) return pow(args[0], args[1]);
  return function_back(GiNaC::ex_to<GiNaC::function>(e).get_name(), args.at(0));
}

bool Names::uses(const ex& e, Kind kind) const {
  for (auto it = e.preorder_begin(); it != e.preorder_end(); ++it) {
    if (!GiNaC::is_a<symbol>(*it)) continue;
    const auto found = symbols_.find(GiNaC::ex_to<symbol>(*it).get_name());
    if (found != symbols_.end() && found->second.second == kind) return true;
  }
  return false;
}

std::vector<ex> summands(const ex& expanded) {
  if (expanded.is_zero()) return {};
  if (!GiNaC::is_a<GiNaC::add>(expanded)) return {expanded};
  return {expanded.begin(), expanded.end()};
}

namespace {

bool is_call(const ex& e, const char* name) {
  return GiNaC::is_a<GiNaC::function>(e) && GiNaC::ex_to<GiNaC::function>(e).get_name() == name;
}

/// sin(s + p) and cos(s + p) of states s and parameters p by the addition theorem: each then stands in a factor of its
/// own.
struct SplitAngles : GiNaC::map_function {
  explicit SplitAngles(const Names& n) : names(n) {}
  const Names& names;
  ex operator()(const ex& e) override {
    const bool sine = is_call(e, "sin"), cosine = is_call(e, "cos");
    if (!sine && !cosine) return e.nops() > 0 ? e.map(*this) : e;
    ex states = 0, parameters = 0;
    for (const ex& part : summands(e.op(0).expand())) {
      (names.uses(part, Names::Kind::state) ? states : parameters) += part;
    }
    if (states.is_zero() || parameters.is_zero()) return e;
    using GiNaC::cos;
    using GiNaC::sin;
    return sine ? sin(states) * cos(parameters) + cos(states) * sin(parameters)
                : cos(states) * cos(parameters) - sin(states) * sin(parameters);
  }
};

}  // namespace

ex reduced(const ex& e, const Names& names) {
  SplitAngles split_angles(names);
  ex result = split_angles(e).expand();
  GiNaC::exset angles;
  for (auto it = result.preorder_begin(); it != result.preorder_end(); ++it) {
    if (is_call(*it, "sin")) angles.insert(it->op(0));
  }
  for (const ex& angle : angles) {
    const ex sine = GiNaC::sin(angle), square = 1 - GiNaC::pow(GiNaC::cos(angle), 2);
    for (int power = 8; power >= 2; --power) {
      result =
          result.subs(GiNaC::pow(sine, power) == GiNaC::pow(square, power / 2) * GiNaC::pow(sine, power % 2)).expand();
    }
  }
  return result;
}

ex without_signs(const ex& e, const ex& variable) {
  return e.subs(GiNaC::lst{sign(variable) == 1, magnitude(variable) == variable});
}

namespace {

struct InsertValues : GiNaC::map_function {
  InsertValues(const GiNaC::exmap& v, const Names& n) : values(v), names(n) {}
  const GiNaC::exmap& values;
  const Names& names;
  ex operator()(const ex& e) override {
    const bool root = GiNaC::is_a<GiNaC::power>(e) && !e.op(1).info(GiNaC::info_flags::posint);
    if ((root || GiNaC::is_a<GiNaC::function>(e)) && names.uses(e, Names::Kind::state) &&
        names.uses(e, Names::Kind::parameter)) {
      return e.subs(values);
    }
    return e.nops() > 0 ? e.map(*this) : e;
  }
};

}  // namespace

ex with_values_inside_functions(const ex& e, const GiNaC::exmap& values, const Names& names) {
  return InsertValues(values, names)(e);
}

Split split(const ex& summand, const Names& names) {
  Split result{1, 1};
  const std::size_t n = GiNaC::is_a<GiNaC::mul>(summand) ? summand.nops() : 1;
  for (std::size_t i = 0; i < n; ++i) {
    const ex factor = GiNaC::is_a<GiNaC::mul>(summand) ? summand.op(i) : summand;
    const bool state = names.uses(factor, Names::Kind::state);
    if (state && names.uses(factor, Names::Kind::parameter)) {
      throw Error(
          fmt::format("a parameter without exact value is inside '{}', which depends on states too: the equations are "
                      "not linear in unknowns; give the parameter a value",
                      names.to(factor).str()));
    }
    (state ? result.states : result.parameters) *= factor;
  }
  return result;
}

}  // namespace whirl::lagrange::algebra
