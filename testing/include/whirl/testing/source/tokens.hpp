#pragma once
#include <algorithm>
#include <cctype>
#include <iterator>
#include <pugixml.hpp>
#include <string>
#include <string_view>

namespace whirl::testing {

namespace detail {

/// The text without comments and with every string empty. `line` and `open` begin comments.
inline std::string code_of(std::string_view text, std::string_view line, std::string_view open,
                           std::string_view quotes) {
  std::string out;
  while (!text.empty()) {
    const auto starts = [&](std::string_view with) { return !with.empty() && text.starts_with(with); };
    const auto skip_to = [&](std::string_view end, bool keep) {
      const std::size_t at = text.find(end);
      text.remove_prefix(at == text.npos ? text.size() : at + (keep ? 0 : end.size()));
    };
    if (starts(line)) {
      skip_to("\n", true);
    } else if (starts(open)) {
      text.remove_prefix(2);
      skip_to("*/", false);
    } else if (quotes.find(text.front()) != quotes.npos) {
      const std::string end = text.starts_with("\"\"\"") ? "\"\"\"" : std::string(1, text.front());
      text.remove_prefix(end.size());
      while (!text.empty() && !text.starts_with(end)) text.remove_prefix(text.front() == '\\' ? 2 : 1);
      text.remove_prefix(std::min(end.size(), text.size()));
      out += "\"\"";
    } else {
      out += text.front();
      text.remove_prefix(1);
    }
  }
  return out;
}

/// Control sequences and special characters of LaTeX that act.
inline std::string acting(std::string_view text) {
  std::string out;
  text.remove_prefix(std::min(text.find("\\begin"), text.size()));  // after the comment
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\') {
      std::size_t end = i + 1;
      while (end < text.size() && std::isalpha(static_cast<unsigned char>(text[end])) != 0) ++end;
      const std::string word(text.substr(i, std::max(end, i + 2) - i));
      i += word.size() - 1;
      constexpr std::string_view kText[] = {"\\_", "\\%", "\\&", "\\#", "\\$", "\\{", "\\}"};
      if (std::find(std::begin(kText), std::end(kText), word) != std::end(kText)) continue;
      if (word == "\\textbackslash" || word == "\\^" || word == "\\~") {
        i += 2;  // {}
        continue;
      }
      out += word;
    } else if (std::string_view("{}&#%~^").find(text[i]) != std::string_view::npos) {
      out += text[i];
    }
  }
  return out;
}

/// Elements and the names of their attributes; another unit has others of its own.
inline std::string structure(const pugi::xml_node& node) {
  std::string out = node.name();
  for (const pugi::xml_attribute& a : node.attributes()) {
    if (a.name() != std::string_view("unit")) out += std::string(" ") + a.name();
  }
  for (const pugi::xml_node& child : node.children()) {
    if (child.name() != std::string_view("UnitDefinitions")) out += "\n(" + structure(child) + ")";
  }
  return out;
}

}  // namespace detail

/// What acts in a generated file, by the ending of its name: its tokens without comments and texts. Sources of harmless
/// and of hostile text have the same.
inline std::string tokens(std::string_view name, const std::string& text) {
  if (name.ends_with(".c") || name.ends_with(".h")) return detail::code_of(text, "//", "/*", "\"'");
  if (name.ends_with(".py")) return detail::code_of(text, "#", "", "\"'");
  if (name.ends_with(".m")) return detail::code_of(text, "%", "", "\"");
  if (name.ends_with(".mo")) return detail::code_of(text, "//", "/*", "\"");
  if (name.ends_with(".tex")) return detail::acting(text);
  if (!name.ends_with(".xml")) return text;
  pugi::xml_document xml;
  return xml.load_string(text.c_str()) ? detail::structure(xml) : "damaged";
}

}  // namespace whirl::testing
