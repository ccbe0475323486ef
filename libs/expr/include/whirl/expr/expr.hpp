#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace whirl::expr {

/// Functions a term may call. `sgn(0)` is 0. `sqrt(x)` is the power x^0.5.
enum class Function : std::uint8_t { abs, sgn, exp, log, sin, cos, tan, tanh, min, max };
std::string_view to_string(Function function);

namespace detail {
struct ExprNode;
}

/// A symbolic term: an immutable value in canonical form, cheap to copy.
///
/// Every construction puts the term in canonical order, folds constants and merges like terms and like factors, so that
/// two terms that differ only by these rules are equal and hash equal: `X1*X3^2 == X3*X1*X3`. Sums are not expanded and
/// quotients are cancelled as for real numbers other than zero (x/x is 1). Real numbers only; angles in radians.
/// Nested deeper than 500 levels, larger than 100000 nodes, or with a constant that is not finite: throws Error.
class Expr {
 public:
  enum class Kind : std::uint8_t { number, symbol, function, power, product, sum };

  Expr(double value = 0);  // NOLINT: numbers convert
  static Expr symbol(std::string_view name);
  static Expr call(Function function, std::vector<Expr> arguments);
  static Expr sum(std::vector<Expr> terms);
  static Expr product(std::vector<Expr> factors);

  /// Reads a term: `+ - * / ^` (also `**`), parentheses, the functions above and `sqrt`, decimal numbers, `pi`, and
  /// variables: a letter or underscore, then letters, digits, underscores, then any number of primes (X1, ux, X2').
  /// `^` binds tighter than a sign and to the right: -x^2 = -(x^2), a^b^c = a^(b^c).
  /// Throws Error with the column (from 1), what was expected and what was found.
  static Expr parse(std::string_view text);

  Kind kind() const;
  bool is_number() const { return kind() == Kind::number; }
  bool is_number(double value) const { return is_number() && this->value() == value; }
  double value() const;                   ///< of a number
  const std::string& name() const;        ///< of a symbol
  Function function() const;              ///< of a function
  const std::vector<Expr>& args() const;  ///< base and exponent of a power; terms; factors (a number comes first)
  std::size_t hash() const;
  std::size_t size() const;  ///< nodes of the tree
  std::size_t depth() const;

  /// Text that `parse` reads back to an equal term.
  std::string str() const;

  friend bool operator==(const Expr& a, const Expr& b) { return compare(a, b) == 0; }
  /// Canonical order: < 0, 0, > 0.
  friend int compare(const Expr& a, const Expr& b);

 private:
  explicit Expr(std::shared_ptr<const detail::ExprNode> node) : node_(std::move(node)) {}
  std::shared_ptr<const detail::ExprNode> node_;
  friend struct detail::ExprNode;
};

int compare(const Expr& a, const Expr& b);
Expr operator+(const Expr& a, const Expr& b);
Expr operator-(const Expr& a, const Expr& b);
Expr operator-(const Expr& a);
Expr operator*(const Expr& a, const Expr& b);
Expr operator/(const Expr& a, const Expr& b);
Expr pow(const Expr& base, const Expr& exponent);
Expr sin(const Expr& x);
Expr cos(const Expr& x);
Expr exp(const Expr& x);
Expr abs(const Expr& x);
Expr sgn(const Expr& x);

/// Derivative with respect to the symbol `variable`; other symbols are constants. |x|' = sgn x, sgn' = 0.
Expr differentiate(const Expr& e, std::string_view variable);
/// Every symbol found in `values` replaced by its term.
Expr substitute(const Expr& e, const std::map<std::string, Expr, std::less<>>& values);
/// Sum of products: products and positive integer powers (up to 20) of sums multiplied out, at every level.
Expr expand(const Expr& e);
/// Names of the symbols, in natural order (X2 before X10).
std::vector<std::string> variables(const Expr& e);
/// Value at a point; throws Error when a symbol is missing. Slow: use a Tape for many points.
double evaluate(const Expr& e, const std::map<std::string, double, std::less<>>& values);
/// e = number * rest, with no numeric factor left in `rest` (1 when e is a number).
std::pair<double, Expr> split_coefficient(const Expr& e);

/// Written form of a term in another language.
enum class Notation { text, latex, c99, matlab, modelica, python };
/// How names and numbers are written. Empty functions: the name as it is (LaTeX: greek letters and subscripts), the
/// shortest decimal that reads back to the same double.
struct PrintOptions {
  std::function<std::string(std::string_view)> name;
  std::function<std::string(double)> number;
};
/// In C99, MATLAB and so on `sgn` prints as the language's own function, in C99 as (x > 0) - (x < 0).
std::string print(const Expr& e, Notation notation, const PrintOptions& options = {});
inline std::string to_latex(const Expr& e) { return print(e, Notation::latex); }
inline std::string to_c99(const Expr& e) { return print(e, Notation::c99); }
/// Shortest decimal text that reads back to the same double; with ".0" when `real` and it would look like an integer.
std::string number_text(double value, bool real = false);
/// LaTeX of a variable name: beta -> \beta, X12' -> X_{12}'.
std::string latex_name(std::string_view name);

}  // namespace whirl::expr

template <>
struct std::hash<whirl::expr::Expr> {
  std::size_t operator()(const whirl::expr::Expr& e) const noexcept { return e.hash(); }
};
