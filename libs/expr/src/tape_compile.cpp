#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include "node.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/tape.hpp"

namespace whirl::expr {

using Kind = Expr::Kind;

namespace {

/// Value numbering: every distinct operation on the same operands is emitted once.
class Emitter {
 public:
  using Op = Tape::Op;

  Emitter(const std::vector<Expr>& terms, const std::vector<std::string>& variables) : variables_(variables) {
    for (std::size_t i = 0; i < variables.size(); ++i) index_.emplace(variables[i], static_cast<std::uint32_t>(i));
    for (const Expr& term : terms) find_angles(term);
  }

  /// Constants are numbered after all are known, so operands are tagged until then.
  struct Ref {
    enum { variable, constant, step } kind;
    std::uint32_t index;
    auto operator<=>(const Ref&) const = default;
  };
  struct Line {
    Op op;
    Ref a, b;
  };

  Ref emit(const Expr& e) {
    if (const auto it = done_.find(e); it != done_.end()) return it->second;
    const Ref ref = build(e);
    done_.emplace(e, ref);
    return ref;
  }

  const std::vector<Line>& lines() const { return lines_; }
  const std::vector<double>& constants() const { return constants_; }

 private:
  Ref constant(double value) {
    const auto [it, added] = constant_index_.emplace(value, static_cast<std::uint32_t>(constants_.size()));
    if (added) constants_.push_back(value);
    return {Ref::constant, it->second};
  }

  Ref line(Op op, Ref a, Ref b) {
    if ((op == Op::add || op == Op::mul) && b < a) std::swap(a, b);
    const auto [it, added] = line_index_.emplace(std::tuple(op, a, b), static_cast<std::uint32_t>(lines_.size()));
    if (added) lines_.push_back({op, a, b});
    return {Ref::step, it->second};
  }
  Ref line(Op op, Ref a) { return line(op, a, a); }

  Ref build(const Expr& e) {
    switch (e.kind()) {
      case Kind::number:
        return constant(e.value());
      case Kind::symbol:
        return variable(e.name());
      case Kind::function:
        return function(e);
      case Kind::power:
        return power(emit(e.args()[0]), e.args()[1]);
      case Kind::product:
        return product(e);
      case Kind::sum:
        return sum(e);
    }
    return constant(0);
  }

  Ref variable(const std::string& name) const {
    const auto it = index_.find(name);
    if (it != index_.end()) return {Ref::variable, it->second};
    throw Error(fmt::format("term uses variable {}: available are {}", name, fmt::join(variables_, ", ")));
  }

  Ref function(const Expr& e) {
    static constexpr Op ops[] = {Op::abs, Op::sgn, Op::exp,  Op::log, Op::sin,
                                 Op::cos, Op::tan, Op::tanh, Op::min, Op::max};
    const Op op = ops[static_cast<std::size_t>(e.function())];
    const Ref a = emit(e.args()[0]);
    if ((op == Op::sin || op == Op::cos) && sines_.count(e.args()[0]) != 0 && cosines_.count(e.args()[0]) != 0) {
      const Ref sine = line(Op::sin, a), cosine = line(Op::cos, a);  // neighbours: evaluated together
      return op == Op::sin ? sine : cosine;
    }
    return e.args().size() > 1 ? line(op, a, emit(e.args()[1])) : line(op, a);
  }

  void find_angles(const Expr& e) {
    if (e.kind() == Kind::function && e.function() == Function::sin) sines_.insert(e.args()[0]);
    if (e.kind() == Kind::function && e.function() == Function::cos) cosines_.insert(e.args()[0]);
    for (const Expr& arg : e.args()) find_angles(arg);
  }

  Ref integer_power(Ref base, int n) {
    if (n == 1) return base;
    if (n % 2 == 1) return line(Op::mul, integer_power(base, n - 1), base);
    const Ref half = integer_power(base, n / 2);
    return line(Op::mul, half, half);
  }

  Ref power(Ref base, const Expr& exponent) {
    if (exponent.is_number(0.5)) return line(Op::sqrt, base);
    if (detail::is_integer(exponent) && std::abs(exponent.value()) <= 64) {
      const int n = static_cast<int>(exponent.value());
      return n > 0 ? integer_power(base, n) : line(Op::div, constant(1), integer_power(base, -n));
    }
    if (exponent.is_number(-0.5)) return line(Op::div, constant(1), line(Op::sqrt, base));
    return line(Op::pow, base, emit(exponent));
  }

  /// Numbers last, so that products of variables are shared between terms with different coefficients.
  Ref product(const Expr& e) {
    const auto [coefficient, rest] = split_coefficient(e);
    const std::vector<Expr> factors = rest.kind() == Kind::product ? rest.args() : std::vector<Expr>{rest};
    bool above = false, below = false;
    Ref numerator{}, denominator{};
    for (const Expr& factor : factors) {
      if (factor.kind() == Kind::power && factor.args()[1].is_number() && factor.args()[1].value() < 0) {
        const Ref f = emit(pow(factor.args()[0], -factor.args()[1]));
        denominator = below ? line(Op::mul, denominator, f) : f;
        below = true;
      } else {
        const Ref f = emit(factor);
        numerator = above ? line(Op::mul, numerator, f) : f;
        above = true;
      }
    }
    if (!above) return line(Op::div, constant(coefficient), denominator);
    Ref value = below ? line(Op::div, numerator, denominator) : numerator;
    if (coefficient == -1) return line(Op::neg, value);
    return coefficient == 1 ? value : line(Op::mul, value, constant(coefficient));
  }

  Ref sum(const Expr& e) {
    Ref total = emit(e.args()[0]);
    for (std::size_t i = 1; i < e.args().size(); ++i) {
      const Expr& term = e.args()[i];
      total = split_coefficient(term).first < 0 ? line(Op::sub, total, emit(-term)) : line(Op::add, total, emit(term));
    }
    return total;
  }

  const std::vector<std::string>& variables_;
  std::unordered_map<std::string, std::uint32_t> index_;
  std::unordered_map<Expr, Ref> done_;
  std::unordered_set<Expr> sines_, cosines_;  // angles of the terms
  std::map<double, std::uint32_t> constant_index_;
  std::map<std::tuple<Op, Ref, Ref>, std::uint32_t> line_index_;
  std::vector<double> constants_;
  std::vector<Line> lines_;
};

}  // namespace

Tape compile(const std::vector<Expr>& terms, const std::vector<std::string>& variables, std::size_t moving) {
  Emitter emitter(terms, variables);
  std::vector<Emitter::Ref> results;
  for (const Expr& term : terms) results.push_back(emitter.emit(term));
  Tape tape;
  tape.variables_ = variables;
  tape.moving_ = std::min(moving, variables.size());
  tape.constants_ = emitter.constants();
  const auto number = [&](Emitter::Ref ref) {
    const std::size_t base = ref.kind == Emitter::Ref::variable   ? 0
                             : ref.kind == Emitter::Ref::constant ? variables.size()
                                                                  : variables.size() + tape.constants_.size();
    return static_cast<std::uint32_t>(base + ref.index);
  };
  for (const auto& line : emitter.lines()) tape.steps_.push_back({line.op, number(line.a), number(line.b)});
  for (const auto& result : results) tape.outputs_.push_back(number(result));
  tape.allocate();
  tape.group();
  return tape;
}

}  // namespace whirl::expr
