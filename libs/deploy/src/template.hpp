#pragma once
#include <map>
#include <set>
#include <string>
#include <string_view>

namespace whirl::deploy {

/// Text of a file of `c/` or of a method's fragment (laws/NAME, estimators/NAME); empty when there is none such.
std::string_view deploy_template(std::string_view name);

/// How the templates become a source file. They are ordinary C:
///   `#if HAS_A || HAS_B`, `#elif`, `#else`, `#endif`   resolved with `features`; other directives are kept
///   a slot, `@name@` between the signs of a C comment  replaced by `slots`; alone on its line it may hold many lines
///   `R(0.5)`, `M(sqrt)`                                a literal and a function of the math library in the precision
///   `whirl_`, `WHIRL_` at the start of a name          the prefix
struct TemplateSettings {
  std::string prefix;
  bool single_precision = false;
  std::set<std::string, std::less<>> features;  ///< without HAS_
  std::map<std::string, std::string, std::less<>> slots;
};

/// Resolves a template; throws Error when a slot is not given or the directives do not match.
std::string fill_template(std::string_view text, const TemplateSettings& settings);

/// The sections of a fragment, each begun by a line `NAME` between the signs of a C comment with `==`, resolved but for
/// precision and prefix, which the file they are put into resolves; without the last line end.
std::map<std::string, std::string> template_sections(std::string_view text, const TemplateSettings& settings);

/// Leaves out static functions that nothing uses, with the comment above them.
std::string drop_unused_functions(std::string text);

/// `value` as a C literal of the precision that reads back to the same number.
std::string c_literal(double value, bool single_precision);

}  // namespace whirl::deploy
