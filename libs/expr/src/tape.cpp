#include "whirl/expr/tape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::expr {

namespace {

constexpr std::uint32_t kMaxSlots = 4096;
constexpr std::uint32_t kNone = 0xffffffffu;
constexpr Eigen::Index kBlock = 256;

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
/// Those that need no moving variable come first.
void Tape::group() {
  const std::size_t fixed = variables_.size() + constants_.size(), n = steps_.size();
  if (fixed + n > kMaxSlots) return;
  struct Place {
    bool moves;
    std::uint32_t level;
    Op op;
    bool pair;
    std::uint32_t step;
    auto operator<=>(const Place&) const = default;
  };
  std::vector<Place> order;
  std::vector<std::uint32_t> level(n, 0);
  std::vector<char> moves(n, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    for (const std::uint32_t operand : {steps_[i].a, steps_[i].b}) {
      moves[i] |= operand < fixed ? operand < moving_ : moves[operand - fixed];
      if (operand >= fixed) level[i] = std::max(level[i], level[operand - fixed] + 1);
    }
    const bool second = !order.empty() && order.back().pair && order.back().step + 1 == i;
    if (second) continue;  // the cosine of the sine before
    const bool pair =
        i + 1 < n && steps_[i].op == Op::sin && steps_[i + 1].op == Op::cos && steps_[i + 1].a == steps_[i].a;
    order.push_back({moves[i] != 0, level[i], steps_[i].op, pair, i});
  }
  std::ranges::sort(order);
  std::vector<std::uint32_t> slot(fixed + n);
  for (std::uint32_t k = 0; k < fixed; ++k) slot[k] = k;
  auto next = static_cast<std::uint32_t>(fixed);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Place& p = order[k];
    const bool same = k > 0 && order[k - 1].moves == p.moves && order[k - 1].level == p.level &&
                      order[k - 1].op == p.op && order[k - 1].pair == p.pair;
    if (!same) {
      groups_.push_back({p.op, p.pair, 0, static_cast<std::uint32_t>(operands_.size()), next});
      if (!p.moves) held_ = groups_.size();
    }
    ++groups_.back().count;
    operands_.push_back({slot[steps_[p.step].a], slot[steps_[p.step].b]});
    slot[fixed + p.step] = next++;
    if (p.pair) slot[fixed + p.step + 1] = next++;
  }
  for (const std::uint32_t o : outputs_) results_.push_back(slot[o]);
}

void Tape::run(std::size_t first, std::size_t last, double* slot) const noexcept {
  for (std::size_t g = first; g < last; ++g) {
    const Group& group = groups_[g];
    const Operands* p = operands_.data() + group.first;
    const Operands* const end = p + group.count;
    double* to = slot + group.to;
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
  run(0, groups_.size(), slot);
  for (const std::uint32_t r : results_) *out++ = slot[r];
}

void Tape::hold(const double* held, std::vector<double>& slots) const {
  slots.resize(variables_.size() + constants_.size() + steps_.size());
  std::copy_n(held, variables_.size() - moving_, slots.begin() + static_cast<std::ptrdiff_t>(moving_));
  std::ranges::copy(constants_, slots.begin() + static_cast<std::ptrdiff_t>(variables_.size()));
  run(0, held_, slots.data());
}

void Tape::evaluate_held(const double* moving, std::vector<double>& slots, double* out) const noexcept {
  std::copy_n(moving, moving_, slots.begin());
  if (groups_.empty()) return evaluate_point(slots.data(), out);
  run(held_, groups_.size(), slots.data());
  for (const std::uint32_t r : results_) *out++ = slots[r];
}

}  // namespace whirl::expr
