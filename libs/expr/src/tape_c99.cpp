#include <fmt/format.h>

#include "whirl/expr/expr.hpp"
#include "whirl/expr/tape.hpp"

namespace whirl::expr {
namespace {

class Writer {
 public:
  explicit Writer(const Tape::C99Options& options) : options_(options) {}

  std::string literal(double value) const {
    const std::string text = number_text(value, true);
    const std::string wrapped = options_.literal_macro.empty() ? text : options_.literal_macro + "(" + text + ")";
    return value < 0 && options_.literal_macro.empty() ? "(" + wrapped + ")" : wrapped;
  }

  /// One operation; functions of one value leave `b` aside.
  std::string value(Tape::Op op, const std::string& a, const std::string& b) const {
    switch (op) {
      case Tape::Op::add:
        return a + " + " + b;
      case Tape::Op::sub:
        return a + " - " + b;
      case Tape::Op::mul:
        return a + " * " + b;
      case Tape::Op::div:
        return a + " / " + b;
      case Tape::Op::neg:
        return "-" + a;
      case Tape::Op::pow:
        return call("pow", a + ", " + b);
      case Tape::Op::sgn:
        return fmt::format("({})(({} > {z}) - ({} < {z}))", options_.type, a, a, fmt::arg("z", literal(0)));
      case Tape::Op::min:
        return fmt::format("{} < {} ? {} : {}", a, b, a, b);
      case Tape::Op::max:
        return fmt::format("{} > {} ? {} : {}", a, b, a, b);
      default:
        return call(function(op), a);
    }
  }

 private:
  static const char* function(Tape::Op op) {
    switch (op) {
      case Tape::Op::sqrt:
        return "sqrt";
      case Tape::Op::abs:
        return "fabs";
      case Tape::Op::exp:
        return "exp";
      case Tape::Op::log:
        return "log";
      case Tape::Op::sin:
        return "sin";
      case Tape::Op::cos:
        return "cos";
      case Tape::Op::tan:
        return "tan";
      default:
        return "tanh";
    }
  }
  std::string call(const char* name, const std::string& arguments) const {
    return (options_.function_macro.empty() ? name : options_.function_macro + "(" + name + ")") + "(" + arguments +
           ")";
  }

  const Tape::C99Options& options_;
};

}  // namespace

std::string Tape::c99(const C99Options& options) const {
  const std::size_t n_vars = variables_.size(), fixed = n_vars + constants_.size();
  const Writer writer(options);
  const auto operand = [&](std::uint32_t value) {
    if (value < n_vars) return options.inputs.empty() ? variables_[value] : options.inputs[value];
    if (value < fixed) return writer.literal(constants_[value - n_vars]);
    return options.prefix + std::to_string(value - fixed);
  };
  std::string text;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Step& step = steps_[i];
    text += fmt::format("{}const {} {}{} = {};\n", options.indent, options.type, options.prefix, i,
                        writer.value(step.op, operand(step.a), operand(step.b)));
  }
  for (std::size_t k = 0; k < outputs_.size(); ++k) {
    text += fmt::format("{}{} = {};\n", options.indent, options.outputs[k], operand(outputs_[k]));
  }
  return text;
}

}  // namespace whirl::expr
