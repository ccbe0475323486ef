#include "whirl/expr/tape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include "node.hpp"
#include "whirl/core/error.hpp"

namespace whirl::expr {

using Kind = Expr::Kind;

namespace {

constexpr std::uint32_t kMaxSlots = 4096;
constexpr std::uint32_t kNone = 0xffffffffu;
constexpr Eigen::Index kBlock = 256;

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

// A call would cost as much as the operation.
[[gnu::always_inline]] inline double apply(Tape::Op op, double a, double b) noexcept {
  switch (op) {
    case Tape::Op::add:
      return a + b;
    case Tape::Op::sub:
      return a - b;
    case Tape::Op::mul:
      return a * b;
    case Tape::Op::div:
      return a / b;
    case Tape::Op::neg:
      return -a;
    case Tape::Op::sqrt:
      return std::sqrt(a);
    case Tape::Op::pow:
      return std::pow(a, b);
    case Tape::Op::abs:
      return std::abs(a);
    case Tape::Op::sgn:
      return (a > 0) - (a < 0);
    case Tape::Op::exp:
      return std::exp(a);
    case Tape::Op::log:
      return std::log(a);
    case Tape::Op::sin:
      return std::sin(a);
    case Tape::Op::cos:
      return std::cos(a);
    case Tape::Op::tan:
      return std::tan(a);
    case Tape::Op::tanh:
      return std::tanh(a);
    case Tape::Op::min:
      return a < b ? a : b;
    case Tape::Op::max:
      return a > b ? a : b;
  }
  return 0;
}

/// One operation over n samples. The cheap operations go through Eigen for its vector instructions; the others call the
/// C library per sample, whose last bit the exported C shares.
void apply(Tape::Op op, const double* pa, const double* pb, double* pto, Eigen::Index n) {
  const Eigen::Map<const Eigen::ArrayXd> a(pa, n), b(pb, n);
  Eigen::Map<Eigen::ArrayXd> to(pto, n);
  switch (op) {
    case Tape::Op::add:
      to = a + b;
      break;
    case Tape::Op::sub:
      to = a - b;
      break;
    case Tape::Op::mul:
      to = a * b;
      break;
    case Tape::Op::div:
      to = a / b;
      break;
    case Tape::Op::neg:
      to = -a;
      break;
    case Tape::Op::abs:
      to = a.abs();
      break;
    case Tape::Op::sqrt:
      for (Eigen::Index i = 0; i < n; ++i) pto[i] = std::sqrt(pa[i]);
      break;  // Eigen's may approximate
    case Tape::Op::exp:
      for (Eigen::Index i = 0; i < n; ++i) pto[i] = std::exp(pa[i]);
      break;
    case Tape::Op::sin:
      for (Eigen::Index i = 0; i < n; ++i) pto[i] = std::sin(pa[i]);
      break;
    case Tape::Op::cos:
      for (Eigen::Index i = 0; i < n; ++i) pto[i] = std::cos(pa[i]);
      break;
    default:
      for (Eigen::Index i = 0; i < n; ++i) pto[i] = apply(op, pa[i], pb[i]);
      break;
  }
}

/// Sine and cosine of one angle share the reduction of the angle; the compiler makes one call of the two.
void sine_cosine(const double* angle, double* sine, double* cosine, Eigen::Index n) noexcept {
  for (Eigen::Index i = 0; i < n; ++i) {
    const double x = angle[i];
    sine[i] = std::sin(x);
    cosine[i] = std::cos(x);
  }
}

}  // namespace

Tape compile(const std::vector<Expr>& terms, const std::vector<std::string>& variables) {
  Emitter emitter(terms, variables);
  std::vector<Emitter::Ref> results;
  for (const Expr& term : terms) results.push_back(emitter.emit(term));
  Tape tape;
  tape.variables_ = variables;
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

/// Gives every step a slot: its output column when it is one, else the first register whose value is no longer needed.
void Tape::allocate() {
  const auto fixed = static_cast<std::uint32_t>(variables_.size() + constants_.size());
  const auto n = static_cast<std::uint32_t>(steps_.size());
  std::vector<std::uint32_t> last_use(n, 0), output(n, kNone);
  for (std::uint32_t i = 0; i < n; ++i) {
    for (const std::uint32_t operand : {steps_[i].a, steps_[i].b}) {
      if (operand >= fixed) last_use[operand - fixed] = i;
    }
  }
  for (std::uint32_t k = 0; k < outputs_.size(); ++k) {
    if (outputs_[k] >= fixed && output[outputs_[k] - fixed] == kNone) output[outputs_[k] - fixed] = k;
  }
  // Registers are numbered first; outputs follow them, so output slots are patched at the end.
  std::vector<std::uint32_t> slot(n), unused;
  for (std::uint32_t i = 0; i < n; ++i) {
    std::vector<std::uint32_t> freed;
    for (const std::uint32_t operand : {steps_[i].a, steps_[i].b}) {
      if (operand < fixed) continue;
      const std::uint32_t s = operand - fixed;
      if (last_use[s] == i && output[s] == kNone && std::find(freed.begin(), freed.end(), slot[s]) == freed.end()) {
        freed.push_back(slot[s]);
      }
    }
    unused.insert(unused.end(), freed.begin(), freed.end());  // in place is fine: operations are element by element
    if (output[i] != kNone) continue;
    if (unused.empty()) {
      slot[i] = registers_++;
    } else {
      slot[i] = unused.back();
      unused.pop_back();
    }
  }
  const std::size_t total = fixed + registers_ + outputs_.size();
  if (total > kMaxSlots)
    throw Error(fmt::format("tape needs {} slots: at most {} allowed; compile fewer terms together", total, kMaxSlots));
  const auto place = [&](std::uint32_t value) {
    if (value < fixed) return value;
    const std::uint32_t i = value - fixed;
    return output[i] != kNone ? fixed + registers_ + output[i] : fixed + slot[i];
  };
  for (std::uint32_t i = 0; i < n; ++i) {
    const bool pair =
        i + 1 < n && steps_[i].op == Op::sin && steps_[i + 1].op == Op::cos && steps_[i + 1].a == steps_[i].a;
    code_.push_back(
        {steps_[i].op, place(steps_[i].a), place(steps_[i].b), place(fixed + i), pair ? place(fixed + i + 1) : kNone});
    if (pair) ++i;
  }
  for (std::uint32_t k = 0; k < outputs_.size(); ++k) {
    const std::uint32_t from = place(outputs_[k]), to = fixed + registers_ + k;
    if (from != to) copies_.push_back({from, to});
  }
}

void Tape::evaluate(const Eigen::Ref<const Eigen::MatrixXd>& variables, Eigen::Ref<Eigen::MatrixXd> out) const {
  const auto n_vars = static_cast<Eigen::Index>(variables_.size()), n_out = static_cast<Eigen::Index>(outputs_.size());
  if (variables.cols() != n_vars || out.cols() != n_out || out.rows() != variables.rows()) {
    throw Error(fmt::format("tape of {} variables and {} terms evaluated on {} x {} into {} x {}", n_vars, n_out,
                            variables.rows(), variables.cols(), out.rows(), out.cols()));
  }
  const auto n_const = static_cast<Eigen::Index>(constants_.size());
  Eigen::MatrixXd scratch(std::min(kBlock, variables.rows()), n_const + registers_);
  std::vector<double*> slot(static_cast<std::size_t>(n_vars + scratch.cols() + n_out));
  for (Eigen::Index k = 0; k < n_const; ++k) scratch.col(k).setConstant(constants_[static_cast<std::size_t>(k)]);
  for (Eigen::Index k = 0; k < scratch.cols(); ++k) slot[static_cast<std::size_t>(n_vars + k)] = scratch.col(k).data();
  for (Eigen::Index row = 0; row < variables.rows(); row += kBlock) {
    const Eigen::Index n = std::min(kBlock, variables.rows() - row);
    for (Eigen::Index k = 0; k < n_vars; ++k) {  // columns of variables are only read
      slot[static_cast<std::size_t>(k)] = const_cast<double*>(variables.data() + k * variables.outerStride() + row);
    }
    for (Eigen::Index k = 0; k < n_out; ++k) {
      slot[static_cast<std::size_t>(n_vars + scratch.cols() + k)] = out.data() + k * out.outerStride() + row;
    }
    for (const Instruction& i : code_) {
      if (i.cosine != kNone) {
        sine_cosine(slot[i.a], slot[i.to], slot[i.cosine], n);
      } else {
        apply(i.op, slot[i.a], slot[i.b], slot[i.to], n);
      }
    }
    for (const Copy& c : copies_) std::copy_n(slot[c.from], n, slot[c.to]);
  }
}

Eigen::MatrixXd Tape::evaluate(const Eigen::Ref<const Eigen::MatrixXd>& variables) const {
  Eigen::MatrixXd out(variables.rows(), static_cast<Eigen::Index>(outputs_.size()));
  evaluate(variables, out);
  return out;
}

/// Sorts the steps by what they need and then by operation, so that a point runs through long loops of one operation.
void Tape::group() {
  const std::size_t fixed = variables_.size() + constants_.size(), n = steps_.size();
  if (fixed + n > kMaxSlots) return;
  struct Place {
    std::uint32_t level;
    Op op;
    bool pair;
    std::uint32_t step;
    auto operator<=>(const Place&) const = default;
  };
  std::vector<Place> order;
  std::vector<std::uint32_t> level(n, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    for (const std::uint32_t operand : {steps_[i].a, steps_[i].b})
      if (operand >= fixed) level[i] = std::max(level[i], level[operand - fixed] + 1);
    const bool second = !order.empty() && order.back().pair && order.back().step + 1 == i;
    if (second) continue;  // the cosine of the sine before
    const bool pair =
        i + 1 < n && steps_[i].op == Op::sin && steps_[i + 1].op == Op::cos && steps_[i + 1].a == steps_[i].a;
    order.push_back({level[i], steps_[i].op, pair, i});
  }
  std::ranges::sort(order);
  std::vector<std::uint32_t> slot(fixed + n);
  for (std::uint32_t k = 0; k < fixed; ++k) slot[k] = k;
  auto next = static_cast<std::uint32_t>(fixed);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Place& p = order[k];
    const bool same = k > 0 && order[k - 1].level == p.level && order[k - 1].op == p.op && order[k - 1].pair == p.pair;
    if (!same) groups_.push_back({p.op, p.pair, 0});
    ++groups_.back().count;
    operands_.push_back({slot[steps_[p.step].a], slot[steps_[p.step].b]});
    slot[fixed + p.step] = next++;
    if (p.pair) slot[fixed + p.step + 1] = next++;
  }
  for (const std::uint32_t o : outputs_) results_.push_back(slot[o]);
}

void Tape::evaluate_point(const double* in, double* out) const noexcept {
  double slot[kMaxSlots];
  std::copy_n(in, variables_.size(), slot);
  std::copy_n(constants_.data(), constants_.size(), slot + variables_.size());
  if (groups_.empty()) {  // too many steps for slots of their own, or none
    for (const Instruction& i : code_) {
      if (i.cosine != kNone)
        sine_cosine(slot + i.a, slot + i.to, slot + i.cosine, 1);
      else
        slot[i.to] = apply(i.op, slot[i.a], slot[i.b]);
    }
    for (const Copy& c : copies_) slot[c.to] = slot[c.from];
    std::copy_n(slot + variables_.size() + constants_.size() + registers_, outputs_.size(), out);
    return;
  }
  const Operands* p = operands_.data();
  double* to = slot + variables_.size() + constants_.size();
  for (const Group& group : groups_) {
    const Operands* const end = p + group.count;
    switch (group.op) {
      case Op::mul:
        for (; p != end; ++p) *to++ = slot[p->a] * slot[p->b];
        break;
      case Op::add:
        for (; p != end; ++p) *to++ = slot[p->a] + slot[p->b];
        break;
      case Op::sub:
        for (; p != end; ++p) *to++ = slot[p->a] - slot[p->b];
        break;
      default:
        if (group.sine_cosine)
          for (; p != end; ++p, to += 2) sine_cosine(slot + p->a, to, to + 1, 1);
        else
          for (; p != end; ++p) *to++ = apply(group.op, slot[p->a], slot[p->b]);
    }
  }
  for (const std::uint32_t r : results_) *out++ = slot[r];
}

}  // namespace whirl::expr
