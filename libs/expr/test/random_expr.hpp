#pragma once
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
    case 0: return "(" + sub() + " + " + sub() + ")";
    case 1: return "(" + sub() + " - " + sub() + ")";
    case 2:
    case 3: return sub() + "*" + sub();
    case 4: return "(" + sub() + ")/(2 + (" + sub() + ")^2)";
    case 5: return "(" + sub() + ")^" + std::to_string(pick(4) + 1);
    case 6: return "-" + sub();
    case 7: return "sin(" + sub() + ")";
    case 8: return "cos(" + sub() + ")";
    case 9: return "tanh(" + sub() + ")";
    case 10: return "abs(" + sub() + ")*sgn(" + sub() + ")";
    case 11: return "sqrt(1 + abs(" + sub() + "))/exp(sin(" + sub() + "))";
    default: return "min(" + sub() + ", max(" + sub() + ", log(2 + (" + sub() + ")^2)^1.3))";
  }
}

}  // namespace whirl::testing
