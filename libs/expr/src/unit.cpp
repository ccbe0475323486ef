#include "whirl/expr/unit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::expr {

namespace {

/// Derived units reduced to kg, m, s; rad is a number.
const std::map<std::string, std::map<std::string, double>, std::less<>>& derived() {
  static const std::map<std::string, std::map<std::string, double>, std::less<>> table = {
      {"rad", {}},
      {"Hz", {{"s", -1}}},
      {"N", {{"kg", 1}, {"m", 1}, {"s", -2}}},
      {"J", {{"kg", 1}, {"m", 2}, {"s", -2}}},
      {"W", {{"kg", 1}, {"m", 2}, {"s", -3}}},
      {"Pa", {{"kg", 1}, {"m", -1}, {"s", -2}}}};
  return table;
}

}  // namespace

Unit operator*(const Unit& a, const Unit& b) {
  Unit result = a;
  for (const auto& [symbol, power] : b.powers_) {
    if ((result.powers_[symbol] += power) == 0) result.powers_.erase(symbol);
  }
  return result;
}

Unit Unit::power(double exponent) const {
  Unit result;
  if (exponent == 0) return result;
  for (const auto& [symbol, power] : powers_) result.powers_[symbol] = power * exponent;
  return result;
}

Unit operator/(const Unit& a, const Unit& b) { return a * b.power(-1); }

Unit Unit::parse(std::string_view text) {
  const auto fail = [text](std::size_t at, std::string_view expected) -> Error {
    return Error(fmt::format("unit \"{}\", column {}: expected {}", text, at + 1, expected));
  };
  Unit result;
  std::size_t at = 0;
  double sign = 1;  // of the next factor
  bool divided = false, group = false, value = false;
  while (at < text.size()) {
    const char c = text[at];
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (c == ' ' || c == '*') {
      ++at;
    } else if (c == '/' && value && !group) {
      if (divided) throw fail(at, "one '/' only (write 1/(m^2 s^2))");
      divided = true;
      sign = -1;
      value = false;
      ++at;
    } else if (c == '(' && divided && !group && !value) {
      group = true;
      ++at;
    } else if (c == ')' && group && value) {
      group = false;
      ++at;
    } else if (c == '1' && !value) {
      value = true;
      ++at;
    } else if (is_letter) {
      if (divided && !group && value) throw fail(at, "the end (put several divisors in parentheses)");
      const std::size_t start = at;
      while (at < text.size() && ((text[at] >= 'a' && text[at] <= 'z') || (text[at] >= 'A' && text[at] <= 'Z'))) ++at;
      const std::string symbol(text.substr(start, at - start));
      double exponent = 1;
      if (at < text.size() && text[at] == '^') {
        ++at;
        const auto [end, error] = std::from_chars(text.data() + at, text.data() + text.size(), exponent);
        if (error != std::errc() || !std::isfinite(exponent)) throw fail(at, "a number as exponent");
        at = static_cast<std::size_t>(end - text.data());
      }
      Unit factor;
      if (const auto it = derived().find(symbol); it != derived().end()) {
        factor.powers_ = it->second;
      } else {
        factor.powers_[symbol] = 1;
      }
      result = result * factor.power(sign * exponent);
      value = true;
    } else {
      throw fail(at, "a unit such as m/s^2 or 1/(m^2 s^2)");
    }
  }
  if (group || (divided && !value)) throw fail(at, group ? "')'" : "a unit after '/'");
  return result;
}

bool Unit::is_si() const {
  static constexpr std::string_view base[] = {"kg", "m", "s", "A", "K", "V"};
  return std::all_of(powers_.begin(), powers_.end(), [](const auto& power) {
    return std::find(std::begin(base), std::end(base), power.first) != std::end(base);
  });
}

std::string Unit::str() const {
  std::string above, below;
  int divisors = 0;
  for (const auto& [symbol, power] : powers_) {
    std::string& side = power > 0 ? above : below;
    if (!side.empty()) side += ' ';
    side += symbol;
    if (std::abs(power) != 1) side += '^' + number_text(std::abs(power));
    divisors += power < 0;
  }
  if (above.empty()) above = "1";
  if (divisors == 0) return above;
  return above + '/' + (divisors > 1 ? '(' + below + ')' : below);
}

std::optional<Unit> unit_of(const Expr& e, const UnitMap& units) {
  switch (e.kind()) {
    case Expr::Kind::number:
      return Unit();
    case Expr::Kind::symbol: {
      const auto it = units.find(e.name());
      if (it == units.end()) return std::nullopt;
      return it->second;
    }
    case Expr::Kind::product: {
      Unit result;
      for (const Expr& arg : e.args()) {
        const std::optional<Unit> unit = unit_of(arg, units);
        if (!unit) return std::nullopt;
        result = result * *unit;
      }
      return result;
    }
    case Expr::Kind::power: {
      const std::optional<Unit> base = unit_of(e.args()[0], units), exponent = unit_of(e.args()[1], units);
      if (!base || !exponent || !exponent->dimensionless()) return std::nullopt;
      if (e.args()[1].is_number()) return base->power(e.args()[1].value());
      return base->dimensionless() ? base : std::nullopt;
    }
    default:
      break;
  }
  // A sum and min, max: all alike (a zero constant has every unit, but canonical sums hold none). Functions: of
  // numbers.
  std::optional<Unit> common;
  for (const Expr& arg : e.args()) {
    const std::optional<Unit> unit = unit_of(arg, units);
    if (!unit || (common && !(*common == *unit))) return std::nullopt;
    common = unit;
  }
  if (e.kind() == Expr::Kind::sum) return common;
  switch (e.function()) {
    case Function::abs:
    case Function::min:
    case Function::max:
      return common;
    case Function::sgn:
      return Unit();
    default:
      return common->dimensionless() ? common : std::nullopt;
  }
}

std::string coefficient_unit(const Expr& term, const Unit& lhs, const UnitMap& units) {
  const std::optional<Unit> unit = unit_of(term, units);
  return unit ? (lhs / *unit).str() : "";
}

const UnitMap& rotor_units() {
  static const UnitMap units = {{"X1", Unit::parse("m")},       {"X2", Unit::parse("m/s")},
                                {"X3", Unit::parse("m")},       {"X4", Unit::parse("m/s")},
                                {"X5", Unit::parse("rad")},     {"X6", Unit::parse("rad/s")},
                                {"X7", Unit::parse("rad/s^2")}, {"ux", Unit::parse("N")},
                                {"uy", Unit::parse("N")},       {"t", Unit::parse("s")}};
  return units;
}

}  // namespace whirl::expr
