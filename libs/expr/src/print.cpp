// Terms as text in six notations, one walk for all.
#include <array>
#include <charconv>
#include <cmath>

#include "node.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::expr {

using Kind = Expr::Kind;

std::string number_text(double value, bool real) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  std::string text(buffer.data(), end);
  if (real && text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string latex_name(std::string_view name) {
  std::size_t primes = 0;
  while (!name.empty() && name.back() == '\'') {
    name.remove_suffix(1);
    ++primes;
  }
  std::size_t stem = name.size();
  while (stem > 1 && name[stem - 1] >= '0' && name[stem - 1] <= '9') --stem;
  std::string head(name.substr(0, stem)), index(name.substr(stem));
  if (const std::size_t bar = head.find('_'); bar != std::string::npos && bar > 0) {
    index = head.substr(bar + 1) + index;
    head.resize(bar);
  }
  static constexpr std::string_view greek[] = {"alpha",  "beta", "gamma", "delta", "epsilon", "zeta", "theta", "kappa",
                                               "lambda", "mu",   "rho",   "sigma", "tau",     "phi",  "psi",   "omega"};
  bool symbol = head.size() == 1;
  for (const std::string_view letter : greek) {
    if (head == letter) {
      head.insert(0, "\\");
      symbol = true;
    }
  }
  const auto roman = [](std::string text) {
    for (std::size_t i = 0; (i = text.find('_', i)) != std::string::npos; i += 2) text.insert(i, "\\");
    return "\\mathrm{" + text + "}";
  };
  std::string out = symbol ? head : roman(head);
  if (!index.empty()) {
    out += "_{" +
           (index.find_first_not_of("0123456789") == std::string::npos || index.size() == 1 ? index : roman(index)) +
           "}";
  }
  return out + std::string(primes, '\'');
}

namespace {

enum Level { kSum = 1, kProduct, kPower, kAtom };

class Printer {
 public:
  Printer(Notation notation, const PrintOptions& options) : notation_(notation), options_(options) {}

  std::string term(const Expr& e, Level needed = kSum) const {
    std::string text;
    Level level = kAtom;
    switch (e.kind()) {
      case Kind::number:
        text = number(e.value());
        if (e.value() < 0) level = kSum;
        break;
      case Kind::symbol:
        text = name(e.name());
        break;
      case Kind::function:
        text = call(e);
        break;
      case Kind::power:
        text = power(e, level);
        break;
      case Kind::product:
        text = product(e, level);
        break;
      case Kind::sum:
        text = sum(e);
        level = kSum;
        break;
    }
    return level < needed ? open() + text + close() : text;
  }

 private:
  bool latex() const { return notation_ == Notation::latex; }
  std::string open() const { return latex() ? "\\left(" : "("; }
  std::string close() const { return latex() ? "\\right)" : ")"; }
  std::string times() const { return latex() ? " " : "*"; }

  std::string name(const std::string& symbol) const {
    if (options_.name) return options_.name(symbol);
    return latex() ? latex_name(symbol) : symbol;
  }

  std::string number(double value) const {
    if (options_.number) return options_.number(value);
    std::string text = number_text(value, notation_ == Notation::c99);
    if (!latex()) return text;
    if (const std::size_t e = text.find('e'); e != std::string::npos) {
      const std::string mantissa = text.substr(0, e), exponent = number_text(std::stod(text.substr(e + 1)));
      text = (mantissa == "1" ? "" : mantissa == "-1" ? "-" : mantissa + " \\cdot ") + "10^{" + exponent + "}";
    }
    return text;
  }

  std::string function_name(Function function) const {
    const std::string plain(to_string(function));
    switch (notation_) {
      case Notation::text:
        return plain;
      case Notation::c99:
        if (function == Function::abs) return "fabs";
        if (function == Function::min) return "fmin";
        if (function == Function::max) return "fmax";
        return plain;
      case Notation::latex:
        return function == Function::sgn ? "\\operatorname{sgn}" : "\\" + plain;
      case Notation::matlab:
      case Notation::modelica:
        return function == Function::sgn ? "sign" : plain;
      case Notation::python:
        if (function == Function::sgn) return "np.sign";
        if (function == Function::min || function == Function::max) return "np." + plain + "imum";
        return "np." + plain;
    }
    return plain;
  }

  std::string call(const Expr& e) const {
    const std::string x = term(e.args()[0]);
    if (notation_ == Notation::c99 && e.function() == Function::sgn) return "((" + x + " > 0) - (" + x + " < 0))";
    if (latex() && e.function() == Function::abs) return "\\left|" + x + "\\right|";
    std::string text = function_name(e.function()) + open() + x;
    if (e.args().size() > 1) text += ", " + term(e.args()[1]);
    return text + close();
  }

  std::string root(const Expr& base) const {
    if (latex()) return "\\sqrt{" + term(base) + "}";
    return (notation_ == Notation::python ? "np.sqrt(" : "sqrt(") + term(base) + ")";
  }

  /// Powers with a negative number as exponent are written as quotients by product(), except the bare one here.
  std::string power(const Expr& e, Level& level) const {
    const Expr &base = e.args()[0], &exponent = e.args()[1];
    if (exponent.is_number() && exponent.value() < 0) return product(e, level);
    if (exponent.is_number(0.5)) {
      level = kAtom;
      return root(base);
    }
    if (notation_ == Notation::c99) {
      if (detail::is_integer(exponent) && exponent.value() <= 4 && base.kind() == Kind::symbol) {
        level = kProduct;
        std::string text = name(base.name());
        for (int i = 1; i < static_cast<int>(exponent.value()); ++i) text += "*" + name(base.name());
        return text;
      }
      level = kAtom;
      return "pow(" + term(base) + ", " + term(exponent) + ")";
    }
    level = kPower;
    if (latex()) {
      if (base.kind() == Kind::function && base.function() != Function::abs && base.args().size() == 1) {  // sin^2(x)
        return function_name(base.function()) + "^{" + term(exponent) + "}" + open() + term(base.args()[0]) + close();
      }
      return term(base, kAtom) + "^{" + term(exponent) + "}";
    }
    return term(base, kAtom) + (notation_ == Notation::python ? "**" : "^") + term(exponent, kAtom);
  }

  static std::vector<Expr> factors(const Expr& e) {
    return e.kind() == Kind::product ? e.args() : std::vector<Expr>{e};
  }

  std::string product(const Expr& e, Level& level) const {
    level = kProduct;
    std::string sign, above, below;
    std::size_t count_below = 0;
    const auto join = [this](std::string& text, const std::string& factor) {
      if (!text.empty()) text += times();
      text += factor;
    };
    for (const Expr& factor : factors(e)) {
      if (factor.is_number()) {
        if (factor.value() < 0) {
          sign = "-";
          level = kSum;
        }
        if (std::abs(factor.value()) != 1) join(above, number(std::abs(factor.value())));
      } else if (factor.kind() == Kind::power && factor.args()[1].is_number() && factor.args()[1].value() < 0) {
        join(below, term(pow(factor.args()[0], -factor.args()[1]), latex() ? kSum : kProduct));
        ++count_below;
      } else {
        join(above, term(factor, kProduct));
      }
    }
    if (above.empty()) above = number(1);
    if (below.empty()) return sign + above;
    if (latex()) {
      if (count_below > 1) below = grouped_below(e);
      return sign + "\\frac{" + above + "}{" + below + "}";
    }
    // A single divisor that prints as a product (x*x in C) needs the parentheses as well.
    const bool atom = count_below == 1 && below.find_first_of("*/") == std::string::npos;
    return sign + above + "/" + (atom ? below : "(" + below + ")");
  }

  std::string grouped_below(const Expr& e) const {
    std::string text;
    for (const Expr& factor : factors(e)) {
      if (factor.kind() == Kind::power && factor.args()[1].is_number() && factor.args()[1].value() < 0) {
        if (!text.empty()) text += times();
        text += term(pow(factor.args()[0], -factor.args()[1]), kProduct);
      }
    }
    return text;
  }

  std::string sum(const Expr& e) const {
    std::string text;
    for (const Expr& arg : e.args()) {
      const bool minus = split_coefficient(arg).first < 0;
      if (text.empty()) {
        text = term(arg);
      } else {
        text += minus ? " - " : " + ";
        text += term(minus ? -arg : arg);
      }
    }
    return text;
  }

  Notation notation_;
  const PrintOptions& options_;
};

}  // namespace

std::string print(const Expr& e, Notation notation, const PrintOptions& options) {
  return Printer(notation, options).term(e);
}

std::string Expr::str() const { return print(*this, Notation::text); }

}  // namespace whirl::expr
