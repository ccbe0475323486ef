#pragma once
#include <cmath>
#include <random>
#include <string>

namespace whirl::testing {

/// Random term text over X1, X2, X3, t. Functions stay inside their domains, so that values are finite near 1.
inline std::string random_term(std::mt19937_64& rng, int depth) {
  const auto pick = [&rng](int n) { return static_cast<int>(rng() % static_cast<unsigned long long>(n)); };
  static const char* const leaves[] = {"X1", "X2", "X3", "t", "2", "0.25", "3", "1e-3"};
  if (depth == 0) return leaves[pick(8)];
  const auto sub = [&] { return random_term(rng, depth - 1 - pick(2) * (depth > 1)); };
  switch (pick(13)) {
    case 0:
      return "(" + sub() + " + " + sub() + ")";
    case 1:
      return "(" + sub() + " - " + sub() + ")";
    case 2:
    case 3:
      return sub() + "*" + sub();
    case 4:
      return "(" + sub() + ")/(2 + (" + sub() + ")^2)";
    case 5:
      return "(" + sub() + ")^" + std::to_string(pick(4) + 1);
    case 6:
      return "-" + sub();
    case 7:
      return "sin(" + sub() + ")";
    case 8:
      return "cos(" + sub() + ")";
    case 9:
      return "tanh(" + sub() + ")";
    case 10:
      return "abs(" + sub() + ")*sgn(" + sub() + ")";
    case 11:
      return "sqrt(1 + abs(" + sub() + "))/exp(sin(" + sub() + "))";
    default:
      return "min(" + sub() + ", max(" + sub() + ", log(2 + (" + sub() + ")^2)^1.3))";
  }
}

/// A term and its value at X1 = 1.3, X2 = -0.7, X3 = 2.1 by plain arithmetic; NaN when an operation on the way is
/// undefined, beyond 1e6, or a sign of rounding.
struct WildTerm {
  std::string text;
  double value;
};

/// Random term text without care for domains: nested powers, quotients, roots of anything.
inline WildTerm wild_term(std::mt19937_64& rng, int depth) {
  const auto pick = [&rng](int n) { return static_cast<int>(rng() % static_cast<unsigned long long>(n)); };
  static const WildTerm leaves[] = {{"X1", 1.3},  {"X2", -0.7}, {"X3", 2.1},    {"0", 0},     {"1", 1}, {"2", 2},
                                    {"0.5", 0.5}, {"3", 3},     {"1e-3", 1e-3}, {"1.5", 1.5}, {"7", 7}};
  if (depth == 0) return leaves[pick(11)];
  const auto sub = [&] { return wild_term(rng, depth - 1 - pick(2) * (depth > 1)); };
  const auto checked = [](const std::string& text, double value) {
    return WildTerm{text, std::abs(value) < 1e6 ? value : std::nan("")};
  };
  const int kind = pick(16);
  const WildTerm a = sub();
  const std::string x = "(" + a.text + ")";
  switch (kind) {
    case 0:
      return checked("-" + x, -a.value);
    case 1:
      return checked("abs" + x, std::abs(a.value));
    case 2:
      return checked("exp" + x, std::exp(a.value));
    case 3:
      return checked("sqrt" + x, std::sqrt(a.value));
    case 4:
      return checked("sin" + x, std::sin(a.value));
    case 5:
      return checked("cos" + x, std::cos(a.value));
    case 6:
      return checked("tanh" + x, std::tanh(a.value));
    case 7:
      return checked("log" + x, std::log(a.value));
    case 8:
      return {"sgn" + x, std::abs(a.value) > 1e-9 || a.value == 0 ? static_cast<double>((a.value > 0) - (a.value < 0))
                                                                  : std::nan("")};
    default:
      break;
  }
  const WildTerm b = sub();
  const std::string y = "(" + b.text + ")";
  switch (kind) {
    case 9:
      return checked(x + " + " + y, a.value + b.value);
    case 10:
      return checked(x + " - " + y, a.value - b.value);
    case 11:
      return checked(x + "*" + y, a.value * b.value);
    case 12:
      return checked("min(" + a.text + ", " + b.text + ")", a.value < b.value ? a.value : b.value + 0 * a.value);
    case 13:
      return checked(x + "/" + y, a.value / b.value);
    default:
      return checked(x + "^" + y, std::pow(a.value, b.value) + 0 * (a.value + b.value));
  }
}

}  // namespace whirl::testing
