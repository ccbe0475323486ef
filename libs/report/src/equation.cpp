#include "whirl/report/equation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "whirl/expr/expr.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/report/format.hpp"

namespace whirl::report {
namespace {

using Kind = expr::Expr::Kind;

struct Greek {
  std::string_view name, letter;
};
constexpr std::array<Greek, 24> kGreek = {
    {{"alpha", "α"}, {"beta", "β"}, {"gamma", "γ"}, {"delta", "δ"}, {"eps", "ε"},    {"epsilon", "ε"},
     {"zeta", "ζ"},  {"eta", "η"},  {"theta", "θ"}, {"kappa", "κ"}, {"lambda", "λ"}, {"mu", "μ"},
     {"nu", "ν"},    {"xi", "ξ"},   {"rho", "ρ"},   {"sigma", "σ"}, {"tau", "τ"},    {"phi", "φ"},
     {"chi", "χ"},   {"psi", "ψ"},  {"omega", "ω"}, {"Omega", "Ω"}, {"Delta", "Δ"},  {"pi", "π"}}};

/// A name on paper: letter or word, subscript, number of dots.
struct Symbol {
  std::string base, subscript;
  int dots = 0;
};

Symbol read_name(std::string_view name, const NameMap& names) {
  const auto primes = [](std::string_view& text) {
    int count = 0;
    while (!text.empty() && text.back() == '\'') {
      text.remove_suffix(1);
      ++count;
    }
    return count;
  };
  Symbol symbol;
  std::string mapped;
  if (const auto exact = names.find(name); exact != names.end()) {
    mapped = exact->second;
  } else {
    symbol.dots = primes(name);
    const auto bare = names.find(name);
    mapped = bare != names.end() ? bare->second : std::string(name);
  }
  std::string_view rest = mapped;
  symbol.dots += primes(rest);
  std::size_t split = rest.find('_', 1);
  if (split != std::string_view::npos) {
    symbol.subscript = rest.substr(split + 1);
  } else {
    split = rest.find_last_not_of("0123456789") + 1;
    symbol.subscript = rest.substr(split);
  }
  symbol.base = rest.substr(0, split);
  return symbol;
}

std::string greek_letter(const std::string& base) {
  const auto* greek = std::find_if(kGreek.begin(), kGreek.end(), [&](const Greek& g) { return g.name == base; });
  return greek != kGreek.end() ? std::string(greek->letter) : base;
}

std::string name_mathml(std::string_view name, const NameMap& names) {
  const Symbol symbol = read_name(name, names);
  std::string out = "<mi>" + escape_markup(greek_letter(symbol.base)) + "</mi>";
  if (symbol.dots > 0) {
    constexpr std::string_view kDots[] = {"˙", "¨", "⃛"};
    out = fmt::format("<mover accent=\"true\">{}<mo>{}</mo></mover>", out, kDots[std::min(symbol.dots, 3) - 1]);
  }
  if (!symbol.subscript.empty()) {
    const bool number = symbol.subscript.find_first_not_of("0123456789") == std::string::npos;
    const std::string_view tag = number ? "mn" : "mi";
    out = fmt::format("<msub>{0}<{1}>{2}</{1}></msub>", out, tag, escape_markup(symbol.subscript));
  }
  return out;
}

std::string name_latex(std::string_view name, const NameMap& names) {
  const Symbol symbol = read_name(name, names);
  const bool greek = greek_letter(symbol.base) != symbol.base;
  std::string out = greek                    ? "\\" + (symbol.base == "eps" ? "varepsilon" : symbol.base)
                    : symbol.base.size() > 1 ? "\\mathrm{" + symbol.base + "}"
                                             : symbol.base;
  constexpr std::string_view kDots[] = {"dot", "ddot", "dddot"};
  if (symbol.dots > 0) out = fmt::format("\\{}{{{}}}", kDots[std::min(symbol.dots, 3) - 1], out);
  if (!symbol.subscript.empty()) out += "_{" + symbol.subscript + "}";
  return out;
}

std::string name_text(std::string_view name, const NameMap& names) {
  const Symbol symbol = read_name(name, names);
  std::string out = greek_letter(symbol.base);
  if (symbol.dots == 1) out += "\u0307";
  if (symbol.dots == 2) out += "\u0308";
  if (symbol.dots == 3) out += "\u20DB";
  const bool number = symbol.subscript.find_first_not_of("0123456789") == std::string::npos;
  constexpr std::string_view kLow[] = {"₀", "₁", "₂", "₃", "₄", "₅", "₆", "₇", "₈", "₉"};
  if (!number) return out + "_" + symbol.subscript;
  for (const char digit : symbol.subscript) out += kLow[digit - '0'];
  return out;
}

/// Writes a term as MathML. Precedence: 0 sum, 1 product, 2 power.
class MathmlWriter {
 public:
  explicit MathmlWriter(const NameMap& names) : names_(names) {}

  std::string write(const expr::Expr& e, int precedence = 0) const {
    switch (e.kind()) {
      case Kind::number:
        return number(e.value(), precedence);
      case Kind::symbol:
        return name_mathml(e.name(), names_);
      case Kind::function:
        return call(e);
      case Kind::power:
        return power(e.args()[0], e.args()[1], precedence);
      case Kind::product:
        return parenthesise(product(e), precedence > 1);
      case Kind::sum:
        return parenthesise(sum(e), precedence > 0);
    }
    return {};
  }

 private:
  static std::string parenthesise(const std::string& inside, bool needed) {
    return needed ? "<mrow><mo>(</mo>" + inside + "<mo>)</mo></mrow>" : "<mrow>" + inside + "</mrow>";
  }
  static std::string number(double value, int precedence) {
    const std::string digits = "<mn>" + expr::number_text(std::abs(value)) + "</mn>";
    return std::signbit(value) ? parenthesise("<mo>−</mo>" + digits, precedence > 0) : digits;
  }
  std::string call(const expr::Expr& e) const {
    if (e.function() == expr::Function::abs) return "<mrow><mo>|</mo>" + write(e.args()[0]) + "<mo>|</mo></mrow>";
    std::string arguments;
    for (const expr::Expr& argument : e.args()) {
      if (!arguments.empty()) arguments += "<mo>,</mo>";
      arguments += write(argument);
    }
    // A single name needs no parentheses: cos β.
    const bool bare = e.args().size() == 1 && e.args()[0].kind() == Kind::symbol;
    return fmt::format("<mrow><mi>{}</mi><mo>&#x2061;</mo>{}</mrow>", to_string(e.function()),
                       bare ? "<mspace width=\"0.17em\"/>" + arguments : parenthesise(arguments, true));
  }
  std::string power(const expr::Expr& base, const expr::Expr& exponent, int precedence) const {
    if (exponent.is_number() && exponent.value() < 0) {
      return parenthesise(fraction("<mn>1</mn>", raised(base, -exponent.value(), 0)), precedence > 1);
    }
    if (exponent.is_number(0.5)) return "<msqrt>" + write(base) + "</msqrt>";
    return raised(base, exponent, precedence);
  }
  std::string raised(const expr::Expr& base, const expr::Expr& exponent, int precedence) const {
    if (exponent.is_number(1)) return write(base, precedence);
    if (exponent.is_number(0.5)) return "<msqrt>" + write(base) + "</msqrt>";
    const bool function = base.kind() == Kind::function && base.function() != expr::Function::abs;
    const std::string inside =
        function || base.kind() == Kind::power ? parenthesise(write(base), true) : write(base, 2);
    return "<msup>" + inside + write(exponent) + "</msup>";
  }
  static std::string fraction(const std::string& top, const std::string& bottom) {
    return "<mfrac><mrow>" + top + "</mrow><mrow>" + bottom + "</mrow></mfrac>";
  }
  std::string product(const expr::Expr& e) const {
    std::string top, bottom, sign;
    const auto divides = [](const expr::Expr& factor) {
      return factor.kind() == Kind::power && factor.args()[1].is_number() && factor.args()[1].value() < 0;
    };
    const bool alone = std::count_if(e.args().begin(), e.args().end(), divides) == 1;
    const auto append = [](std::string& to, const std::string& factor) {
      if (!to.empty()) to += "<mspace width=\"0.17em\"/>";
      to += factor;
    };
    for (const expr::Expr& factor : e.args()) {
      if (factor.is_number()) {
        if (factor.value() < 0) sign = "<mo>−</mo>";
        if (std::abs(factor.value()) != 1) append(top, number(std::abs(factor.value()), 1));
      } else if (divides(factor)) {
        append(bottom, raised(factor.args()[0], -factor.args()[1].value(), alone ? 0 : 1));
      } else {
        append(top, write(factor, 1));
      }
    }
    if (top.empty()) top = "<mn>1</mn>";
    return sign + (bottom.empty() ? top : fraction(top, bottom));
  }
  std::string sum(const expr::Expr& e) const {
    std::string out;
    for (const expr::Expr& term : e.args()) {
      const auto [factor, rest] = expr::split_coefficient(term);
      if (!out.empty() || factor < 0) out += factor < 0 ? "<mo>−</mo>" : "<mo>+</mo>";
      out += write(expr::Expr(std::abs(factor)) * rest, 1);
    }
    return out;
  }

  const NameMap& names_;
};

std::string plain_minus_removed(std::string text) {
  constexpr std::string_view kMinus = "\u2212";
  if (text.starts_with(kMinus)) text.erase(0, kMinus.size());
  return text;
}

bool negative(const EquationTerm& term) { return term.coefficient.value < 0; }
bool is_constant(const EquationTerm& term) { return term.function == "1"; }

/// Coefficient without its sign.
RoundedEstimate magnitude(const EquationTerm& term) {
  RoundedEstimate rounded = round_estimate(term.coefficient);
  rounded.value = plain_minus_removed(rounded.value);
  return rounded;
}

}  // namespace

const NameMap& rotor_names() {
  static const NameMap names = {{"X1", "x"},     {"X2", "x'"},     {"X3", "y"},   {"X4", "y'"}, {"X5", "beta"},
                                {"X6", "beta'"}, {"X7", "beta''"}, {"ux", "u_x"}, {"uy", "u_y"}};
  return names;
}

const NameMap& names_of(const IdentifiedModel& model) {
  static const NameMap none;
  const bool rotor = model.rotor.has_value() && !model.states.empty() && model.states.front() == "X1";
  return rotor ? rotor_names() : none;
}

std::string term_mathml(std::string_view function, const NameMap& names) {
  return MathmlWriter(names).write(expr::Expr::parse(function), 1);
}

std::string term_latex(std::string_view function, const NameMap& names) {
  expr::PrintOptions options;
  options.name = [&](std::string_view name) { return name_latex(name, names); };
  return expr::print(expr::Expr::parse(function), whirl::expr::Notation::latex, options);
}

std::string term_text(std::string_view function, const NameMap& names) {
  expr::PrintOptions options;
  options.name = [&](std::string_view name) { return name_text(name, names); };
  return pretty_unit(expr::print(expr::Expr::parse(function), whirl::expr::Notation::text, options));
}

namespace {
/// A sum behind a coefficient needs parentheses.
std::string factor(const std::string& text, const EquationTerm& term, const char* open, const char* close) {
  return expr::Expr::parse(term.function).kind() == expr::Expr::Kind::sum ? open + text + close : text;
}
}  // namespace

std::string to_mathml(const Equation& equation, const NameMap& names) {
  const std::string lhs = name_mathml(equation.lhs, names);
  std::vector<std::string> terms;
  for (const EquationTerm& term : equation.terms) {
    const RoundedEstimate c = magnitude(term);
    std::string out = negative(term) ? "<mo>−</mo>" : terms.empty() ? "" : "<mo>+</mo>";
    std::string number = "<mn>" + c.value + "</mn>";
    if (!c.deviation.empty())
      number = "<mo stretchy=\"false\">(</mo>" + number + "<mo>±</mo><mn>" + c.deviation +
               "</mn><mo stretchy=\"false\">)</mo>";
    out += number;
    if (c.exponent != 0) {
      out += fmt::format("<mo>×</mo><msup><mn>10</mn><mrow>{}<mn>{}</mn></mrow></msup>",
                         c.exponent < 0 ? "<mo>−</mo>" : "", std::abs(c.exponent));
    }
    if (!is_constant(term)) out += "<mspace width=\"0.17em\"/>" + term_mathml(term.function, names);
    terms.push_back(out);
  }
  if (terms.empty()) terms.push_back("<mn>0</mn>");
  std::string out = "<math xmlns=\"http://www.w3.org/1998/Math/MathML\" display=\"block\">";
  if (terms.size() <= 3) {
    out += "<mrow>" + lhs + "<mo>=</mo>";
    for (const std::string& term : terms) out += term;
    return out + "</mrow></math>";
  }
  out += "<mtable columnalign=\"right left\" class=\"aligned\">";
  for (std::size_t i = 0; i < terms.size(); ++i) {
    out += fmt::format("<mtr><mtd>{}</mtd><mtd><mrow>{}</mrow></mtd></mtr>",
                       i == 0 ? "<mrow>" + lhs + "<mo>=</mo></mrow>" : "", terms[i]);
  }
  return out + "</mtable></math>";
}

std::string to_latex(const Equation& equation, const NameMap& names) {
  std::string out = name_latex(equation.lhs, names) + " ={}& ";
  const std::string separator = equation.terms.size() > 3 ? " \\\\\n& " : " ";
  for (std::size_t i = 0; i < equation.terms.size(); ++i) {
    const EquationTerm& term = equation.terms[i];
    const RoundedEstimate c = magnitude(term);
    if (i > 0) out += separator;
    out += negative(term) ? "- " : i > 0 ? "+ " : "";
    out += c.deviation.empty() ? c.value : "(" + c.value + " \\pm " + c.deviation + ")";
    if (c.exponent != 0) out += fmt::format(" \\times 10^{{{}}}", c.exponent);
    if (!is_constant(term)) {
      out += " \\, " + factor(term_latex(term.function, names), term, "\\left(", "\\right)");
    }
  }
  return equation.terms.empty() ? out + "0" : out;
}

std::string to_text(const Equation& equation, const NameMap& names) {
  std::string out = name_text(equation.lhs, names) + " =";
  for (std::size_t i = 0; i < equation.terms.size(); ++i) {
    const EquationTerm& term = equation.terms[i];
    const RoundedEstimate c = magnitude(term);
    out += negative(term) ? " − " : i > 0 ? " + " : " ";
    out += c.deviation.empty() ? c.value : "(" + c.value + " ± " + c.deviation + ")";
    if (c.exponent != 0) out += power_of_ten(c.exponent);
    if (!is_constant(term)) out += " " + factor(term_text(term.function, names), term, "(", ")");
  }
  return equation.terms.empty() ? out + " 0" : out;
}

namespace {

std::vector<std::string> estimate_cells(const Estimate& estimate, const std::string& unit) {
  const bool interval = std::isfinite(estimate.low) && std::isfinite(estimate.high);
  // The interval's ends need as many digits as tell them from the value.
  const double half = 0.5 * (estimate.high - estimate.low);
  const int digits =
      interval && half > 0 && estimate.value != 0
          ? std::clamp(2 + static_cast<int>(std::ceil(std::log10(std::abs(estimate.value) / half))), 3, 10)
          : 4;
  return {format_estimate(estimate),
          interval ? format_number(estimate.low, digits) + " … " + format_number(estimate.high, digits) : "–",
          pretty_unit(unit)};
}

}  // namespace

bool says_nothing(const Equation& equation, const NameMap& names) {
  return equation.terms.size() == 1 && equation.terms.front().coefficient.value == 1 &&
         name_text(equation.lhs, names) == term_text(equation.terms.front().function, names);
}

Table coefficient_table(const IdentifiedModel& model) {
  Table table;
  table.caption = "Coefficients of the identified equations";
  table.columns = {{"equation", "", Align::left},
                   {"function", "", Align::left},
                   {"coefficient ± sd", "", Align::right},
                   {"95 % interval", "", Align::center},
                   {"unit", "", Align::left}};
  const NameMap& names = names_of(model);
  for (const Equation& equation : model.equations) {
    if (says_nothing(equation, names)) continue;
    for (const EquationTerm& term : equation.terms) {
      std::vector<std::string> row = {name_text(equation.lhs, names), term_text(term.function, names)};
      for (std::string& cell : estimate_cells(term.coefficient, term.unit)) row.push_back(std::move(cell));
      table.add(std::move(row));
    }
  }
  return table;
}

bool names_term(const IdentifiedModel& model, std::string_view parameter) {
  for (const Equation& equation : model.equations) {
    for (const EquationTerm& term : equation.terms) {
      if (parameter == term.function || parameter == equation.lhs + ": " + term.function) return true;
    }
  }
  return false;
}

Table parameter_table(const IdentifiedModel& model) {
  Table table;
  table.caption = "Physical parameters";
  table.columns = {{"parameter", "", Align::left},
                   {"value ± sd", "", Align::right},
                   {"95 % interval", "", Align::center},
                   {"unit", "", Align::left}};
  for (const auto& [name, estimate] : model.parameters) {
    if (names_term(model, name)) continue;
    std::vector<std::string> row = {name};
    for (std::string& cell : estimate_cells(estimate, std::string(io::parameter_unit(name))))
      row.push_back(std::move(cell));
    table.add(std::move(row));
  }
  return table;
}

}  // namespace whirl::report
