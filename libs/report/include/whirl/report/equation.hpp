#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/report/table.hpp"

namespace whirl::report {

/// How a name of the model is written: name in the model -> name on paper, e.g. "X2" -> "x'" (one dot per prime).
using NameMap = std::map<std::string, std::string, std::less<>>;

/// X1..X7 -> x, x', y, y', beta, beta', beta'' (paper eq. 22).
const NameMap& rotor_names();
/// rotor_names() when the model is a rotor in the states X1.., nothing otherwise.
const NameMap& names_of(const IdentifiedModel& model);

/// A function such as "X6^2*cos(X5)" as MathML (without the <math> element), as LaTeX and as plain text. Names: greek
/// letters by name, digits or text behind "_" as subscript, one dot per prime. Throws Error when the text is not a term
/// (expr/expr.hpp).
std::string term_mathml(std::string_view function, const NameMap& names = {});
std::string term_latex(std::string_view function, const NameMap& names = {});
std::string term_text(std::string_view function, const NameMap& names = {});

/// The equation with coefficients rounded by their uncertainty, one term per line when there are more than three.
std::string to_mathml(const Equation& equation, const NameMap& names = {});  ///< a complete <math> element
std::string to_latex(const Equation& equation, const NameMap& names = {});   ///< lines of an aligned environment
std::string to_text(const Equation& equation, const NameMap& names = {});    ///< one line, for a terminal

/// x' = x': the state of a rotor that is the derivative of another. Left out of tables and pages.
bool says_nothing(const Equation& equation, const NameMap& names);
/// Every coefficient with standard deviation, 95 % interval and unit.
Table coefficient_table(const IdentifiedModel& model);
/// Physical parameters of the model (k1, k2, c, ...) likewise, without those that are the coefficient of one term.
Table parameter_table(const IdentifiedModel& model);
/// Whether the parameter is the coefficient of one term: "x^3", or "v': x^3".
bool names_term(const IdentifiedModel& model, std::string_view parameter);

}  // namespace whirl::report
