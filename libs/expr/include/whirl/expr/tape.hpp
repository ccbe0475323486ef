#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "whirl/expr/expr.hpp"

namespace whirl::expr {

/// A list of terms compiled to a straight line of operations in which a common subexpression occurs once.
///
/// `evaluate` runs each operation over blocks of samples, so that nothing is interpreted per sample; `evaluate_point`
/// serves integrators. Both give the same bits as the C99 source of `c99` compiled without floating-point contraction.
/// Integer powers up to 64 are products. Immutable after compile(): one tape may be used by several threads.
class Tape {
 public:
  enum class Op : std::uint8_t {
    add,
    sub,
    mul,
    div,
    neg,
    sqrt,
    pow,
    abs,
    sgn,
    exp,
    log,
    sin,
    cos,
    tan,
    tanh,
    min,
    max
  };
  /// Operands are value numbers: variables first, then constants, then the steps in order.
  struct Step {
    Op op;
    std::uint32_t a, b;  ///< b is a for operations of one operand
  };

  Tape() = default;

  /// Columns of `variables` in the order given to compile(), samples in rows; `out` is samples x terms.
  /// Throws Error when a size does not fit.
  void evaluate(const Eigen::Ref<const Eigen::MatrixXd>& variables, Eigen::Ref<Eigen::MatrixXd> out) const;
  Eigen::MatrixXd evaluate(const Eigen::Ref<const Eigen::MatrixXd>& variables) const;
  /// One point: `in` has n_variables() values, `out` takes n_outputs(). No allocation. `in` and `out` may not overlap.
  void evaluate_point(const double* in, double* out) const noexcept;

  /// Many points that differ in the first `moving` variables of compile() alone: hold() takes the values of the others
  /// and works out what follows from them, evaluate_held() the rest, with the bits of evaluate_point. `slots` is theirs
  /// between the calls; no allocation after the first hold().
  void hold(const double* held, std::vector<double>& slots) const;
  void evaluate_held(const double* moving, std::vector<double>& slots, double* out) const noexcept;

  std::size_t n_variables() const { return variables_.size(); }
  std::size_t n_outputs() const { return outputs_.size(); }
  const std::vector<std::string>& variables() const { return variables_; }
  const std::vector<double>& constants() const { return constants_; }
  const std::vector<Step>& steps() const { return steps_; }
  const std::vector<std::uint32_t>& outputs() const { return outputs_; }

  /// Body of a C99 function: one `const <type> <prefix><i> = ...;` per step, then `<output[k]> = ...;`.
  struct C99Options {
    std::string type = "double";
    std::string indent = "  ";
    std::string prefix = "w";          ///< of the intermediate names
    std::vector<std::string> inputs;   ///< C text of each variable; empty: the variable names
    std::vector<std::string> outputs;  ///< left-hand sides, one per term
    std::string literal_macro;         ///< e.g. "REAL": numbers are written REAL(0.5); empty: plain
    std::string function_macro;        ///< e.g. "FN": sin(x) is written FN(sin)(x); empty: plain
  };
  std::string c99(const C99Options& options) const;

 private:
  struct Instruction {
    Op op;
    std::uint32_t a, b, to;  ///< slots: variables, constants, registers, outputs
    std::uint32_t cosine;    ///< slot of the cosine of a sine's angle, computed with it
  };
  struct Copy {
    std::uint32_t from, to;
  };
  /// Steps of one operation that do not need each other, one after the other in `operands_` and in their results.
  struct Group {
    Op op;
    bool sine_cosine;  ///< each has two results
    std::uint32_t count;
    std::uint32_t first, to;  ///< of its operands, and of the slots of its results
  };
  struct Operands {
    std::uint32_t a, b;
  };
  friend Tape compile(const std::vector<Expr>&, const std::vector<std::string>&, std::size_t);
  void allocate();
  void group();
  void run(std::size_t first, std::size_t last, double* slot) const noexcept;

  std::vector<std::string> variables_;
  std::vector<double> constants_;
  std::vector<Step> steps_;
  std::vector<std::uint32_t> outputs_;
  std::size_t moving_ = 0;  // variables
  std::vector<Instruction> code_;
  std::vector<Copy> copies_;
  std::uint32_t registers_ = 0;
  // For one point: every step has a slot of its own, in this order.
  std::vector<Group> groups_;
  std::size_t held_ = 0;  // first groups, which need none of the moving variables
  std::vector<Operands> operands_;
  std::vector<std::uint32_t> results_;  // slots of the outputs
};

/// Compiles `terms` for evaluation in `variables` (column order); those from `moving` on may be held
/// (Tape::hold). Throws Error when a term uses another name, naming those allowed, or when the tape would need more
/// than 4096 slots.
Tape compile(const std::vector<Expr>& terms, const std::vector<std::string>& variables,
             std::size_t moving = static_cast<std::size_t>(-1));

}  // namespace whirl::expr
