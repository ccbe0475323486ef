#include "written.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "whirl/core/names.hpp"

namespace whirl::deploy {
namespace {

using Words = std::set<std::string, std::less<>>;

/// Words of the language, functions that terms call, and names that the generated file gives.
const Words& words_of(Language language) {
  static const Words fmi{"time", "inner_step"};
  static const Words python{"False",      "None",   "True",     "and",    "as",     "assert",   "async", "await",
                            "break",      "class",  "continue", "def",    "del",    "elif",     "else",  "for",
                            "from",       "global", "except",   "if",     "import", "finally",  "in",    "is",
                            "match",      "not",    "or",       "lambda", "pass",   "nonlocal", "raise", "return",
                            "try",        "while",  "with",     "yield",  "np",     "math",     "p",     "t",
                            "PARAMETERS", "state",  "inputs",   "rates",  "outputs"};
  static const Words matlab{
      "break",    "case",        "catch", "classdef", "continue", "else",      "elseif",         "end",        "for",
      "function", "global",      "if",    "nargin",   "nargout",  "otherwise", "parfor",         "persistent", "return",
      "spmd",     "switch",      "try",   "while",    "until",    "do",        "unwind_protect", "endif",      "endfor",
      "endwhile", "endfunction", "p",     "t",        "state",    "input",     "rate",           "output",     "zeros",
      "sin",      "cos",         "tan",   "tanh",     "exp",      "log",       "sqrt",           "abs",        "sign",
      "min",      "max",         "pi"};
  static const Words modelica{
      "algorithm",    "and",           "annotation",  "block",     "break",      "class",     "connect",   "connector",
      "constant",     "constrainedby", "der",         "discrete",  "each",       "else",      "elseif",    "elsewhen",
      "encapsulated", "end",           "enumeration", "equation",  "expandable", "extends",   "external",  "false",
      "final",        "flow",          "for",         "function",  "if",         "import",    "impure",    "in",
      "initial",      "inner",         "input",       "loop",      "model",      "not",       "operator",  "or",
      "outer",        "output",        "package",     "parameter", "partial",    "protected", "public",    "pure",
      "record",       "redeclare",     "replaceable", "return",    "stream",     "then",      "true",      "type",
      "when",         "while",         "within",      "time",      "sample",     "pre",       "sin",       "cos",
      "tan",          "tanh",          "exp",         "log",       "sqrt",       "abs",       "sign",      "min",
      "max",          "Real",          "Integer",     "Boolean",   "String",     "RealInput", "RealOutput"};
  switch (language) {
    case Language::fmi:
      return fmi;
    case Language::python:
      return python;
    case Language::matlab:
      return matlab;
    case Language::modelica:
      break;
  }
  return modelica;
}

std::string replace_all(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

}  // namespace

std::string c_comment(std::string_view text) {
  // Twice: "*/*" holds both. A sign at an end could join one outside.
  std::string out = replace_all(replace_all(one_line(text), "*/", "* /"), "/*", "/ *");
  if (!out.empty() && (out.front() == '/' || out.front() == '*')) out.insert(0, " ");
  if (!out.empty() && (out.back() == '/' || out.back() == '*')) out += ' ';
  return out;
}

std::string line_comment(std::string_view text) {
  std::string out = one_line(text);
  if (!out.empty() && out.back() == '\\') out += ' ';
  return out;
}

std::string quoted_text(std::string_view text) {
  std::string out;
  for (const char c : one_line(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string latex_text(std::string_view text) {
  static const std::map<char, std::string_view> kEscapes{{'\\', "\\textbackslash{}"},
                                                         {'^', "\\^{}"},
                                                         {'~', "\\~{}"},
                                                         {'_', "\\_"},
                                                         {'%', "\\%"},
                                                         {'&', "\\&"},
                                                         {'#', "\\#"},
                                                         {'$', "\\$"},
                                                         {'{', "\\{"},
                                                         {'}', "\\}"},
                                                         {'|', "$|$"},
                                                         {'<', "$<$"},
                                                         {'>', "$>$"}};
  std::string out;
  for (const char c : one_line(text)) {
    const auto found = kEscapes.find(c);
    found == kEscapes.end() ? out += c : out += found->second;
  }
  return out;
}

ModelSystem with_names_for(Language language, ModelSystem s) {
  Words taken = words_of(language);
  for (const CodeParameter& p : s.parameters) taken.insert(p.name);
  std::map<std::string, expr::Expr, std::less<>> renamed;
  for (auto* list : {&s.states, &s.inputs, &s.outputs}) {
    for (SystemVariable& v : *list) {
      std::string name = language == Language::matlab && v.name.starts_with('_') ? "v" + v.name : v.name;
      while (taken.contains(name)) name += '_';
      taken.insert(name);
      if (name != v.name && list != &s.outputs) renamed.emplace(v.name, expr::Expr::symbol(name));
      v.name = std::move(name);
    }
  }
  if (renamed.empty()) return s;
  for (auto* terms : {&s.rates, &s.output_terms, &s.events}) {
    for (expr::Expr& e : *terms) e = expr::substitute(e, renamed);
  }
  return s;
}

}  // namespace whirl::deploy
