// Recursive descent over: sum = product {(+|-) product}; product = signed {(*|/) signed}; signed = {+|-} power;
// power = atom [(^|**) signed]; atom = number | name | name ( sum {, sum} ) | ( sum ).
#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "whirl/core/error.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::expr {

namespace {

constexpr int kMaxNesting = 200;
constexpr double kMaxExponent = 1000;
constexpr std::size_t kMaxLength = 100000;

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {
    if (text.size() > kMaxLength)
      throw Error(fmt::format("term of {} characters: at most {} allowed", text.size(), kMaxLength));
  }

  Expr parse() {
    const Expr e = sum();
    skip_space();
    if (at_ < text_.size()) fail("an operator or the end");
    return e;
  }

 private:
  [[noreturn]] void fail(std::string_view expected) {
    skip_space();
    std::string found = "the end";
    if (at_ < text_.size()) {
      const unsigned char c = static_cast<unsigned char>(text_[at_]);
      found = c >= 0x20 && c < 0x7f ? fmt::format("'{}'", text_[at_]) : fmt::format("byte 0x{:02x}", c);
    }
    raise(at_, fmt::format("expected {}, found {}", expected, found));
  }

  [[noreturn]] void raise(std::size_t at, std::string_view what) {
    std::string shown(text_.substr(0, 60));
    for (char& c : shown) {
      if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
    }
    throw Error(fmt::format("term \"{}{}\", column {}: {}", shown, text_.size() > 60 ? "..." : "", at + 1, what));
  }

  void skip_space() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
  }

  bool accept(char c) {
    skip_space();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  /// Builds with the place of the operation, should the canonical form refuse it (1/0, log(-1), ...).
  template <class F>
  Expr build(std::size_t at, F&& make) {
    try {
      return make();
    } catch (const Error& error) {
      raise(at, error.what());
    }
  }

  Expr sum() {
    if (++nesting_ > kMaxNesting) raise(at_, fmt::format("nested more than {} levels deep", kMaxNesting));
    const std::size_t start = at_;
    std::vector<Expr> terms{product()};
    for (;;) {
      if (accept('+')) {
        terms.push_back(product());
      } else if (accept('-')) {
        terms.push_back(-product());
      } else {
        break;
      }
    }
    --nesting_;
    return terms.size() == 1 ? terms[0] : build(start, [&] { return Expr::sum(std::move(terms)); });
  }

  Expr product() {
    const std::size_t start = at_;
    // A sign is a factor -1 of the whole product, not of the factor behind it: -(a + b)*c stays one product.
    std::vector<Expr> factors{signs() ? Expr(-1) : Expr(1), power()};
    for (;;) {
      skip_space();
      const std::size_t at = at_;
      if (accept('*')) {
        if (signs()) factors.emplace_back(-1);
        factors.push_back(power());
      } else if (accept('/')) {
        const Expr divisor = signed_power();
        factors.push_back(build(at, [&] {
          if (divisor.is_number(0)) throw Error("division by zero");
          return pow(divisor, -1);
        }));
      } else {
        break;
      }
    }
    return build(start, [&] { return Expr::product(std::move(factors)); });
  }

  /// Skips any number of signs; true when they make a minus.
  bool signs() {
    bool minus = false;
    for (;;) {
      if (accept('-')) {
        minus = !minus;
      } else if (!accept('+')) {
        return minus;
      }
    }
  }

  Expr signed_power() {
    const bool minus = signs();
    const Expr e = power();
    return minus ? -e : e;
  }

  Expr power() {
    const Expr base = atom();
    skip_space();
    const std::size_t at = at_;
    if (text_.substr(at_, 2) == "**") {
      at_ += 2;
    } else if (!accept('^')) {
      return base;
    }
    if (++nesting_ > kMaxNesting) raise(at, fmt::format("nested more than {} levels deep", kMaxNesting));
    const Expr exponent = signed_power();
    --nesting_;
    const Expr result = build(at, [&] { return pow(base, exponent); });
    // Multiplied out, a power has as many terms as its exponent says; no equation of motion needs this many.
    if (result.kind() == Expr::Kind::power && result.args()[1].is_number() &&
        std::abs(result.args()[1].value()) > kMaxExponent)
      raise(at, fmt::format("exponent {:g} must be between -{:g} and {:g}", result.args()[1].value(), kMaxExponent,
                            kMaxExponent));
    return result;
  }

  static bool letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
  static bool digit(char c) { return c >= '0' && c <= '9'; }

  Expr atom() {
    skip_space();
    if (at_ >= text_.size()) fail("a number, a variable or '('");
    const char c = text_[at_];
    if (digit(c) || c == '.') return number();
    if (letter(c)) return named();
    if (!accept('(')) fail("a number, a variable or '('");
    const Expr inside = sum();
    if (!accept(')')) fail("')' or an operator");
    return inside;
  }

  Expr number() {
    double value = 0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error == std::errc::result_out_of_range) raise(at_, "number out of range");
    if (error != std::errc()) fail("a number");
    at_ = static_cast<std::size_t>(end - text_.data());
    return Expr(value);
  }

  Expr named() {
    const std::size_t start = at_;
    while (at_ < text_.size() && (letter(text_[at_]) || digit(text_[at_]))) ++at_;
    while (at_ < text_.size() && text_[at_] == '\'') ++at_;
    const std::string_view name = text_.substr(start, at_ - start);
    const bool called = accept('(');
    const bool root = name == "sqrt";
    const std::optional<Function> function = lookup(name);
    if (!root && !function) {
      if (called) {
        raise(start, fmt::format("unknown function {}: known are abs sgn exp log sqrt sin cos tan tanh min max", name));
      }
      return name == "pi" ? Expr(std::numbers::pi) : Expr::symbol(name);
    }
    if (!called) fail(fmt::format("'(' after {}", name));
    std::vector<Expr> arguments{sum()};
    while (accept(',')) arguments.push_back(sum());
    const bool two = function == Function::min || function == Function::max;
    if (!accept(')')) fail(two ? "',', ')' or an operator" : "')' or an operator");
    return build(start, [&] {
      if (!root) return Expr::call(*function, std::move(arguments));
      if (arguments.size() != 1) throw Error(fmt::format("sqrt takes 1 argument, found {}", arguments.size()));
      return pow(arguments[0], 0.5);
    });
  }

  static std::optional<Function> lookup(std::string_view name) {
    for (const Function f : {Function::abs, Function::sgn, Function::exp, Function::log, Function::sin, Function::cos,
                             Function::tan, Function::tanh, Function::min, Function::max}) {
      if (name == to_string(f)) return f;
    }
    return std::nullopt;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int nesting_ = 0;
};

}  // namespace

Expr Expr::parse(std::string_view text) { return Parser(text).parse(); }

}  // namespace whirl::expr
