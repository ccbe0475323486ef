#include "template.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::deploy {
namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// Value of "HAS_A || HAS_B"; none when the line asks for something else.
std::optional<bool> condition(std::string_view line, const TemplateSettings& s) {
  bool found = false, value = false;
  for (std::size_t at = line.find("HAS_"); at != std::string_view::npos; at = line.find("HAS_", at + 1)) {
    std::size_t end = at + 4;
    while (end < line.size() && is_word(line[end])) ++end;
    found = true;
    value = value || s.features.contains(line.substr(at + 4, end - at - 4));
  }
  return found ? std::optional(value) : std::nullopt;
}

/// The number that is all of the text.
std::optional<double> number_of(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && !text.empty() ? std::optional(value)
                                                                                   : std::nullopt;
}

struct Branch {
  bool ours = false;   ///< opened by #if HAS_
  bool taken = false;  ///< one of its branches was active
  bool active = true;  ///< this branch is
};

std::string resolve_conditions(std::string_view text, const TemplateSettings& s) {
  std::string out;
  std::vector<Branch> stack;
  const auto active = [&] {
    for (const Branch& b : stack) {
      if (!b.active) return false;
    }
    return true;
  };
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    const std::string_view line = text.substr(0, end + 1);
    text.remove_prefix(end + 1);
    const auto starts = [&](std::string_view word) { return line.starts_with(word); };
    if (starts("#if")) {
      const auto value = starts("#if ") ? condition(line, s) : std::nullopt;
      stack.push_back({value.has_value(), value.value_or(true), value.value_or(true)});
      if (value) continue;
    } else if (starts("#el") || starts("#endif")) {
      if (stack.empty()) throw Error("template: " + std::string(line) + " without #if");
      Branch& b = stack.back();
      const bool ours = b.ours;
      if (starts("#endif")) {
        if (!ours && active()) out += line;
        stack.pop_back();
        continue;
      }
      if (ours) {
        b.active = !b.taken && (starts("#else") || condition(line, s).value_or(false));
        b.taken = b.taken || b.active;
        continue;
      }
    }
    if (active()) out += line;
  }
  if (!stack.empty()) throw Error("template: #if without #endif");
  return out;
}

std::string fill_slots(const std::string& text, const TemplateSettings& s) {
  std::string out;
  std::size_t from = 0;
  for (std::size_t at = text.find("/*@"); at != std::string::npos; at = text.find("/*@", from)) {
    const std::size_t end = text.find("@*/", at);
    const std::string name = text.substr(at + 3, end - at - 3);
    const auto slot = s.slots.find(name);
    if (slot == s.slots.end()) throw Error("template: no slot " + name);
    out += text.substr(from, at - from) + slot->second;
    from = end + 3;
    // A slot alone on its line that is empty leaves no line.
    if (slot->second.empty() && (out.empty() || out.back() == '\n') && from < text.size() && text[from] == '\n') ++from;
  }
  return out + text.substr(from);
}

}  // namespace

std::string c_literal(double value, bool single_precision) {
  if (!single_precision) return expr::number_text(value, true);
  const double rounded = static_cast<double>(static_cast<float>(value));
  return fmt::format("{}F", fmt::format("{:.9g}", rounded).find_first_of(".e") == std::string::npos
                                ? fmt::format("{:.9g}.0", rounded)
                                : fmt::format("{:.9g}", rounded));
}

std::string fill_template(std::string_view text, const TemplateSettings& s) {
  const std::string in = fill_slots(resolve_conditions(text, s), s);
  std::string upper = s.prefix, out;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  for (std::size_t i = 0; i < in.size();) {
    const std::string_view rest = std::string_view(in).substr(i);
    const bool start = i == 0 || !is_word(in[i - 1]);
    const bool call = start && (rest.starts_with("R(") || rest.starts_with("M("));
    const std::string_view inside =
        call ? rest.substr(2, std::min(rest.find(')'), rest.size()) - 2) : std::string_view();
    const auto value = call && rest[0] == 'R' ? number_of(inside) : std::nullopt;
    if (start && rest.starts_with("whirl_")) {
      out += s.prefix + "_";
      i += 6;
    } else if (start && rest.starts_with("WHIRL_")) {
      out += upper + "_";
      i += 6;
    } else if (value) {
      out += c_literal(*value, s.single_precision);
      i += inside.size() + 3;
    } else if (call && rest[0] == 'M' && !inside.empty() && std::all_of(inside.begin(), inside.end(), is_word)) {
      out += std::string(inside) + (s.single_precision ? "f" : "");
      i += inside.size() + 3;
    } else {
      out += in[i++];
    }
  }
  return out;
}

std::map<std::string, std::string> template_sections(std::string_view text, const TemplateSettings& s) {
  const std::string in = fill_slots(resolve_conditions(text, s), s);
  std::map<std::string, std::string> out;
  constexpr std::string_view kOpen = "/*== ", kClose = " ==*/\n";
  for (std::size_t at = in.find(kOpen); at != std::string::npos;) {
    const std::size_t name = at + kOpen.size(), close = in.find(kClose, name);
    if (close == std::string::npos) throw Error("template: a section without end of its name");
    at = in.find(kOpen, close);
    std::string body = in.substr(close + kClose.size(), at - close - kClose.size());
    if (!body.empty() && body.back() == '\n') body.pop_back();
    out[in.substr(name, close - name)] = body;
  }
  return out;
}

std::string drop_unused_functions(std::string text) {
  const auto uses = [&text] {
    std::map<std::string_view, int> count;
    for (std::size_t i = 0; i < text.size();) {
      std::size_t end = i;
      while (end < text.size() && is_word(text[end])) ++end;
      if (end > i) ++count[std::string_view(text).substr(i, end - i)];
      i = end + 1;
    }
    return count;
  };
  const auto next_function = [&text](std::size_t from) {  // at the start of a line
    while (from < text.size() && text.compare(from, 7, "static ") != 0)
      from = std::min(text.find('\n', from), text.size() - 1) + 1;
    return from;
  };
  for (bool dropped = true; dropped;) {
    dropped = false;
    const auto count = uses();
    for (std::size_t at = next_function(0); at < text.size(); at = next_function(text.find('\n', at) + 1)) {
      const std::size_t open = text.find('(', at), end_of_line = text.find('\n', at);
      if (open > end_of_line) continue;  // a table
      std::size_t name = open;
      while (is_word(text[name - 1])) --name;
      if (count.at(std::string_view(text).substr(name, open - name)) > 1) continue;
      std::size_t from = at, to = text[end_of_line - 1] == '}' ? end_of_line + 1 : text.find("\n}\n", at) + 3;
      if (from >= 3 && text.compare(from - 3, 3, "*/\n") == 0) from = text.rfind("/*", from);
      while (to < text.size() && text[to] == '\n') ++to;
      text.erase(from, to - from);
      dropped = true;
      break;
    }
  }
  return text;
}

}  // namespace whirl::deploy
