#include "problem/paper_parameters.hpp"

#include <cmath>
#include <optional>

#include "whirl/expr/expr.hpp"

namespace whirl::identification::detail {
namespace {

/// Value with variance; absent when the model has no such term.
struct Number {
  double value = 0, variance = 0;
  Estimate estimate() const { return Estimate::from_sd(value, std::sqrt(variance)); }
};
using Maybe = std::optional<Number>;

Maybe coefficient(const IdentifiedModel& model, const char* lhs, const char* function) {
  const expr::Expr wanted = expr::Expr::parse(function);
  for (const Equation& equation : model.equations) {
    if (equation.lhs != lhs) continue;
    for (const EquationTerm& term : equation.terms) {
      const auto [factor, rest] = expr::split_coefficient(expr::Expr::parse(term.function));
      if (rest == wanted) {
        const double sd = std::isfinite(term.coefficient.sd) ? term.coefficient.sd : 0;
        return Number{factor * term.coefficient.value, factor * factor * sd * sd};
      }
    }
  }
  return std::nullopt;
}

Maybe scaled(Maybe a, double factor) {
  if (a) *a = {factor * a->value, factor * factor * a->variance};
  return a;
}
/// Absent terms count as zero beside present ones.
Maybe sum(const Maybe& a, const Maybe& b) {
  if (!a || !b) return a ? a : b;
  return Number{a->value + b->value, a->variance + b->variance};
}
Maybe mean(const Maybe& a, const Maybe& b) { return a && b ? scaled(sum(a, b), 0.5) : a ? a : b; }

void add(IdentifiedModel& model, const std::string& name, const Maybe& value) {
  if (value) model.parameters.emplace_back(name, value->estimate());
}

void add_eccentricity(IdentifiedModel& model, const std::string& suffix, const Maybe& re, const Maybe& im) {
  if (!re && !im) return;
  const Number a = re.value_or(Number{}), b = im.value_or(Number{});
  const double e = std::hypot(a.value, b.value);
  if (e == 0) return;
  const double variance = (a.value * a.value * a.variance + b.value * b.value * b.variance) / (e * e);
  const double turn = (b.value * b.value * a.variance + a.value * a.value * b.variance) / (e * e * e * e);
  model.parameters.emplace_back("e" + suffix, Estimate::from_sd(e, std::sqrt(variance)));
  model.parameters.emplace_back("e_phase" + suffix, Estimate::from_sd(std::atan2(b.value, a.value), std::sqrt(turn)));
}

}  // namespace

void add_rotor_parameters(IdentifiedModel& model) {
  const auto x = [&](const char* f) { return coefficient(model, "X2'", f); };
  const auto y = [&](const char* f) { return coefficient(model, "X4'", f); };
  const Maybe k1x = scaled(x("X1"), -1), k1y = scaled(y("X3"), -1);
  // a x^3 + b x y^2: synchronous whirl shows (3 a + b) / 4 only.
  const Maybe k2x = sum(scaled(x("X1^3"), -0.75), scaled(x("X1*X3^2"), -0.25));
  const Maybe k2y = sum(scaled(y("X3^3"), -0.75), scaled(y("X1^2*X3"), -0.25));
  const Maybe cx = scaled(x("X2"), -1), cy = scaled(y("X4"), -1);
  const Maybe re_x = x("X6^2*cos(X5)"), im_x = scaled(x("X6^2*sin(X5)"), -1);
  const Maybe re_y = y("X6^2*sin(X5)"), im_y = y("X6^2*cos(X5)");
  add(model, "k1", mean(k1x, k1y));
  add(model, "k2", mean(k2x, k2y));
  add(model, "c", mean(cx, cy));
  // An axis without a quadrature has zero of it: averages run over both axes.
  const auto both = [](const Maybe& a, const Maybe& b) { return scaled(sum(a, b), 0.5); };
  add_eccentricity(model, "", both(re_x, re_y), both(im_x, im_y));
  add(model, "k1_x", k1x);
  add(model, "k1_y", k1y);
  add(model, "k2_x", k2x);
  add(model, "k2_y", k2y);
  add(model, "c_x", cx);
  add(model, "c_y", cy);
  add_eccentricity(model, "_x", re_x, im_x);
  add_eccentricity(model, "_y", re_y, im_y);
}

}  // namespace whirl::identification::detail
