#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "whirl/core/names.hpp"
#include "whirl/io/settings.hpp"

namespace whirl::io {
namespace {

std::string number(double v, std::string_view key) {
  if (!std::isfinite(v)) throw Error::in_field(key, "NaN or infinite", "finite");
  char buffer[32];
  std::string out(buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr);
  if (out.find_first_of(".e") == std::string::npos) out += ".0";  // a TOML integer otherwise
  return out;
}

std::string written(const TomlEntry& e) {
  if (const auto* d = std::get_if<double>(&e.value)) return number(*d, e.key);
  if (const auto* i = std::get_if<long>(&e.value)) return fmt::format("{}", *i);
  if (const auto* b = std::get_if<bool>(&e.value)) return *b ? "true" : "false";
  if (const auto* s = std::get_if<std::string>(&e.value)) return toml_quoted(*s);
  std::string out = "[";
  for (const double v : std::get<std::vector<double>>(e.value))
    out.append(out.size() > 1 ? ", " : "").append(number(v, e.key));
  return out + "]";
}

bool is_bare(std::string_view name, std::string_view more) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [&](unsigned char c) {
    return (c < 0x80 && std::isalnum(c)) || c == '_' || c == '-' ||
           more.find(static_cast<char>(c)) != std::string_view::npos;
  });
}

}  // namespace

std::string toml_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out.append("\\").push_back(c);
    } else if (code < 0x20 || code == 0x7f) {
      out += fmt::format("\\u{:04x}", code);
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string toml_comment(std::string_view text) { return "# " + one_line(text); }

std::string to_toml(const std::vector<TomlEntry>& entries) {
  std::vector<std::string> tables{""};  // keys without a table must come first
  for (const TomlEntry& e : entries) {
    if (!is_bare(e.key, "") || (!e.table.empty() && !is_bare(e.table, "."))) {
      throw Error::in_field("TOML key", e.table + "." + e.key, "made of letters, digits, '_' and '-'");
    }
    if (std::find(tables.begin(), tables.end(), e.table) == tables.end()) tables.push_back(e.table);
  }
  std::string out;
  for (const std::string& table : tables) {
    if (!table.empty()) out += fmt::format("{}[{}]\n", out.empty() ? "" : "\n", table);
    for (const TomlEntry& e : entries) {
      if (e.table != table) continue;
      out += fmt::format("{} = {}", e.key, written(e));
      if (!e.comment.empty()) out += "  " + toml_comment(e.comment);
      out += '\n';
    }
  }
  return out;
}

}  // namespace whirl::io
