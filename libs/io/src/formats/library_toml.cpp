#include "whirl/io/library_toml.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "whirl/core/names.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/settings.hpp"

namespace whirl::io {
namespace {

expr::Expr term(const Settings& settings, const std::string& path, const std::string& text) {
  try {
    return expr::Expr::parse(text);
  } catch (const Error& e) {
    throw settings.error(path, e.what());
  }
}

std::vector<expr::Expr> terms(const Settings& settings, const std::string& path) {
  std::vector<expr::Expr> result;
  for (const std::string& text : settings.texts(path, {})) result.push_back(term(settings, path, text));
  return result;
}

expr::CandidateLibrary load(const Settings& settings, const std::vector<std::string>& sought) {
  const std::vector<std::string> lhs = settings.texts("equations", sought);
  if (lhs.empty()) throw settings.error("equations", "no equation is named; write e.g. equations = [\"x''\", \"y''\"]");
  for (const std::string& left : lhs) {
    if (!is_left_side(left))
      throw settings.error("equations", fmt::format("'{}' {}", one_line(left.substr(0, 60)), kLeftSideRule));
  }
  std::vector<expr::TiedGroup> groups;
  for (std::size_t g = 0; g < settings.count("group"); ++g) {
    const std::string group = fmt::format("group[{}]", g);
    const std::vector<expr::Expr> places = terms(settings, group + ".terms");
    if (places.size() != lhs.size()) {
      throw settings.error(group + ".terms",
                           fmt::format("holds {} terms, must be one for each of the {} equations (\"0\" "
                                       "where the unknown is absent)",
                                       places.size(), lhs.size()));
    }
    const std::string coefficient = settings.text(group + ".coefficient", "");
    if (!coefficient.empty()) (void)term(settings, group + ".coefficient", coefficient);
    const std::string unit = settings.text(group + ".unit", "");
    try {
      (void)expr::Unit::parse(unit);
    } catch (const Error& e) {
      throw settings.error(group + ".unit", e.what());
    }
    const std::string group_name =
        settings.text(group + ".name", coefficient.empty() ? fmt::format("p{}", g + 1) : coefficient);
    if (!is_label(group_name)) throw settings.error(group + ".name", kLabelRule);
    if (!is_unit_text(unit)) throw settings.error(group + ".unit", kUnitRule);
    groups.push_back(expr::tied_group(group_name, places, coefficient, unit));
    if (groups.back().entries.empty()) throw settings.error(group + ".terms", "must not be 0 everywhere");
  }
  const std::vector<expr::Expr> common = terms(settings, "common");
  std::vector<expr::Expr> known;
  for (std::size_t i = 0; i < lhs.size(); ++i) {
    const std::string own = "terms." + lhs[i], fixed = "known." + lhs[i];
    for (const expr::Expr& function : expr::union_library({common, terms(settings, own)})) {
      groups.push_back({function.str(), {{i, function, 1.0}}, "", ""});
    }
    known.push_back(term(settings, fixed, settings.text(fixed, "0")));
  }
  settings.finish();
  if (std::all_of(known.begin(), known.end(), [](const expr::Expr& e) { return e.is_number(0); })) known.clear();
  if (groups.empty() && known.empty())
    throw Error::in_file(settings.source(), 0, "no candidate term: give common, [terms] or [[group]]");
  try {
    return expr::make_library(lhs, std::move(groups), std::move(known));
  } catch (const Error& e) {
    throw Error::in_file(settings.source(), 0, e.what());
  }
}

std::string list(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += (out.empty() ? "" : ", ") + toml_quoted(text);
  return "[" + out + "]";
}

}  // namespace

expr::CandidateLibrary parse_library_toml(std::string_view text, std::string_view name,
                                          const std::vector<std::string>& lhs) {
  return load(parse_settings(text, name), lhs);
}

expr::CandidateLibrary read_library(const std::filesystem::path& path, const std::vector<std::string>& lhs) {
  return load(read_settings(path), lhs);
}

std::string to_toml(const expr::CandidateLibrary& library, const std::vector<std::string>& comment) {
  std::string out;
  for (const std::string& line : comment) out += toml_comment(line) + "\n";
  out += "equations = " + list(library.lhs) + "\n";
  std::vector<std::vector<std::string>> untied(library.lhs.size());
  std::string tied;
  for (const expr::TiedGroup& group : library.groups) {
    const expr::TiedEntry& first = group.entries.front();
    if (group.entries.size() == 1 && first.factor == 1 && group.coefficient.empty() &&
        group.name == first.function.str()) {
      untied[first.equation].push_back(group.name);
      continue;
    }
    std::vector<std::string> texts;
    for (const expr::Expr& place : expr::group_terms(group, library.lhs.size())) texts.push_back(place.str());
    tied += "\n[[group]]\nname = " + toml_quoted(group.name) + "\n";
    if (!group.coefficient.empty()) tied += "coefficient = " + toml_quoted(group.coefficient) + "\n";
    if (!group.unit.empty()) tied += "unit = " + toml_quoted(group.unit) + "\n";
    tied += "terms = " + list(texts) + "\n";
  }
  std::string own, fixed;
  for (std::size_t i = 0; i < library.lhs.size(); ++i) {
    if (!untied[i].empty()) own += toml_quoted(library.lhs[i]) + " = " + list(untied[i]) + "\n";
    if (!library.known.empty() && !library.known[i].is_number(0)) {
      fixed += toml_quoted(library.lhs[i]) + " = " + toml_quoted(library.known[i].str()) + "\n";
    }
  }
  if (!own.empty()) out += "\n[terms]\n" + own;
  if (!fixed.empty()) out += "\n[known]\n" + fixed;
  return out + tied;
}

}  // namespace whirl::io
