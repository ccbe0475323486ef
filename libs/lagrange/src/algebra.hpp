#pragma once
#include <ginac/ginac.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "whirl/expr/expr.hpp"

namespace whirl::lagrange::algebra {

using GiNaC::ex;
using GiNaC::symbol;

/// Symbols by name, and terms of `expr` to and from the computer algebra. Numbers are exact rationals on that side.
class Names {
 public:
  enum class Kind { state, parameter };
  /// Throws Error when the name is taken.
  symbol declare(const std::string& name, Kind kind);
  ex at(const std::string& name) const;
  bool has(const std::string& name) const { return symbols_.count(name) != 0; }

  /// Throws Error: "<what> '<text>': <reason>" on a fault in the text or a name that is not declared.
  ex read(const std::string& text, const char* what) const;
  ex from(const expr::Expr& e) const;
  expr::Expr to(const ex& e) const;

  /// Whether symbols of the kind occur in e.
  bool uses(const ex& e, Kind kind) const;

 private:
  std::map<std::string, std::pair<symbol, Kind>, std::less<>> symbols_;
};

/// Expanded, angles that mix states and parameters split, even powers of sines replaced by 1 - cos^2.
ex reduced(const ex& e, const Names& names);

/// sgn(variable) and |variable| of a variable that is positive.
ex without_signs(const ex& e, const ex& variable);
/// `values` put in wherever a function or a root holds states and parameters together.
ex with_values_inside_functions(const ex& e, const GiNaC::exmap& values, const Names& names);

/// parameters * states: the two factors of one summand. Throws Error naming the factor that holds both.
struct Split {
  ex parameters, states;
};
Split split(const ex& summand, const Names& names);
std::vector<ex> summands(const ex& expanded);

}  // namespace whirl::lagrange::algebra
