#include "whirl/io/settings.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "whirl/io/file.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

using Numbers = std::vector<double>;
using Texts = std::vector<std::string>;
using Value = std::variant<double, long, bool, std::string, Numbers, Texts>;

struct Entry {
  std::string table, key;
  Value value;
  std::string shown;  // as in the file
  long line = 0;
  mutable bool used = false;
  std::string path() const { return table.empty() ? key : table + "." + key; }
};

constexpr std::string_view type_name(const Value& v) {
  constexpr std::string_view names[] = {"a number",         "a number", "true or false", "text", "an array of numbers",
                                        "an array of texts"};
  return names[v.index()];
}

std::optional<double> as_number(const Value& v) {
  if (const double* d = std::get_if<double>(&v)) return *d;
  if (const long* i = std::get_if<long>(&v)) return static_cast<double>(*i);
  return std::nullopt;
}

struct Path {
  std::string_view table, name;
};
Path split_path(std::string_view path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string_view::npos ? Path{{}, path} : Path{path.substr(0, dot), path.substr(dot + 1)};
}

std::string join(std::string_view table, std::string_view key) {
  return table.empty() ? std::string(key) : fmt::format("{}.{}", table, key);
}

}  // namespace

struct Settings::State {
  std::string source = "settings";
  std::vector<Entry> entries;
  std::vector<std::pair<std::string, std::size_t>> arrays;  // of tables: path and size
  mutable std::vector<std::string> known;                   // full keys asked for

  [[noreturn]] void fail(const Entry& e, std::string_view reason) const {
    throw Error::in_file(source, e.line, fmt::format("{} = {}: {}", e.path(), e.shown, reason));
  }
  void learn(std::string key) const {
    if (std::find(known.begin(), known.end(), key) == known.end()) known.push_back(std::move(key));
  }

  void load(const toml::table& table, const std::string& path) {
    for (const auto& [k, node] : table) {
      const std::string key(k.str());
      const std::string full = join(path, key);
      const long line = static_cast<long>(node.source().begin.line);
      const toml::array* array = node.as_array();
      if (const toml::table* inner = node.as_table()) {
        load(*inner, full);
      } else if (array && !array->empty() && array->is_homogeneous(toml::node_type::table)) {
        arrays.emplace_back(full, array->size());
        for (std::size_t i = 0; i < array->size(); ++i) load(*(*array)[i].as_table(), fmt::format("{}[{}]", full, i));
      } else {
        Entry e{path, key, {}, {}, line};
        std::ostringstream shown;
        if (const auto* d = node.as_floating_point()) {
          shown << fmt::format("{}",
                               d->get());  // the shortest text; the formatter of the library prints 17 digits
        } else {
          shown << toml::toml_formatter{node};
        }
        e.shown = shown.str().substr(0, 60);
        if (array) {
          e.value = load_array(*array, e);
        } else {
          e.value = load_value(node, e);
        }
        entries.push_back(std::move(e));
      }
    }
  }

  Value load_value(const toml::node& node, const Entry& e) const {
    if (const auto* i = node.as_integer()) return static_cast<long>(i->get());
    if (const auto* b = node.as_boolean()) return b->get();
    if (const auto* s = node.as_string()) return s->get();
    if (const auto* d = node.as_floating_point()) {
      if (!std::isfinite(d->get())) fail(e, "must be finite");
      return d->get();
    }
    fail(e, "must be a number, text, true or false, or an array of numbers or texts");
  }

  Value load_array(const toml::array& array, const Entry& e) const {
    Numbers numbers;
    Texts texts;
    for (const toml::node& node : array) {
      if (node.is_array() || node.is_table()) fail(e, "must be an array of numbers or texts");
      const Value v = load_value(node, e);
      if (const auto number = as_number(v)) numbers.push_back(*number);
      if (const auto* text = std::get_if<std::string>(&v)) texts.push_back(*text);
    }
    if (texts.size() == array.size() && !array.empty()) return texts;
    if (numbers.size() != array.size()) fail(e, "must be an array of numbers or an array of texts");
    return numbers;
  }

  const Entry* find_exact(std::string_view table, std::string_view key) const {
    for (const Entry& e : entries) {
      if (e.table == table && e.key == key) return &e;
    }
    return nullptr;
  }

  /// The entry `table.name_<unit>`, and the unit that gives `quantity`; null when absent.
  std::pair<const Entry*, const UnitSuffix*> find(std::string_view table, std::string_view name,
                                                  Quantity quantity) const {
    std::pair<const Entry*, const UnitSuffix*> found{nullptr, nullptr};
    for (const Entry& e : entries) {
      if (e.table != table) continue;
      const UnitSuffix* unit = nullptr;
      if (e.key == name) {
        if (quantity != Quantity::dimensionless) {
          fail(e, fmt::format("has no unit; write {}_{} (allowed units: {})", name, si_suffix(quantity).suffix,
                              allowed_units(quantity)));
        }
        unit = &si_suffix(quantity);
      } else {
        const NameWithUnit split = split_unit(e.key);
        if (!split.unit || split.name != name) continue;
        unit = find_unit(split.unit->suffix, quantity);
        if (!unit) {
          fail(e, fmt::format("must be a {}; allowed units: {}", to_string(quantity), allowed_units(quantity)));
        }
      }
      if (found.first) fail(e, fmt::format("is given twice, see line {}", found.first->line));
      found = {&e, unit};
    }
    return found;
  }

  /// Refuses a key of the table that is one of those asked for but for an unknown unit: what depends on it is no use.
  void require_units(std::string_view table) const {
    for (const Entry& e : entries) {
      if (e.table != table || e.used || split_unit(e.key).unit != nullptr) continue;
      for (const std::string& asked : known) {
        const auto [place, key] = split_path(asked);
        const NameWithUnit wanted = split_unit(key);
        if (place == table && wanted.unit != nullptr && e.key.starts_with(wanted.name + "_"))
          fail(e, "unknown unit; allowed units: " + allowed_units(wanted.unit->quantity));
      }
    }
  }

  double number_of(const Entry& e) const {
    e.used = true;
    const auto number = as_number(e.value);
    if (!number) fail(e, "must be a number");
    return *number;
  }

  template <class T>
  const T* typed(std::string_view path, std::string_view wanted) const {
    const auto [table, name] = split_path(path);
    learn(std::string(path));
    const Entry* e = find_exact(table, name);
    if (!e) return nullptr;
    e->used = true;
    const T* v = std::get_if<T>(&e->value);
    if (!v) fail(*e, fmt::format("is {}, must be {}", type_name(e->value), wanted));
    return v;
  }
};

Settings::Settings() : state_(std::make_unique<State>()) {}
Settings::~Settings() = default;
Settings::Settings(Settings&&) noexcept = default;
Settings& Settings::operator=(Settings&&) noexcept = default;

Settings parse_settings(std::string_view text, std::string_view name) {
  Settings settings;
  Settings::State& state = *settings.state_;
  state.source = name;
  if (const auto first = text.find_first_not_of(" \t\r\n"); first != text.npos && text[first] == '{')
    throw Error::in_file(name, 1, "is JSON; must be TOML (lines of name = value)");
  try {
    state.load(toml::parse(text), "");
  } catch (const toml::parse_error& e) {
    throw Error::in_file(name, static_cast<long>(e.source().begin.line),
                         fmt::format("damaged TOML: {}", e.description()));
  }
  std::stable_sort(state.entries.begin(), state.entries.end(),
                   [](const Entry& a, const Entry& b) { return a.line < b.line; });
  return settings;
}

Settings read_settings(const std::filesystem::path& path) {
  return parse_settings(read_text(path, std::size_t{1} << 24), path.string());
}

std::optional<double> Settings::find_number(std::string_view path, Quantity quantity) const {
  const auto [table, name] = split_path(path);
  state_->learn(quantity == Quantity::dimensionless ? std::string(path)
                                                    : fmt::format("{}_{}", path, si_suffix(quantity).suffix));
  const auto [entry, unit] = state_->find(table, name, quantity);
  if (!entry) return std::nullopt;
  return unit->to_si(state_->number_of(*entry));
}

double Settings::number(std::string_view path, Quantity quantity, double fallback, double low, double high) const {
  const auto value = find_number(path, quantity);
  if (!value) return fallback;
  if (!(*value >= low && *value <= high)) {
    const auto [table, name] = split_path(path);
    const auto [entry, unit] = state_->find(table, name, quantity);
    state_->require_units(table);
    // In the unit of the value: two units in one sentence have to be converted by the reader.
    const bool si = unit == &si_suffix(quantity);
    state_->fail(*entry, fmt::format("must be between {:g} and {:g}{}{}", unit->from_si(low), unit->from_si(high),
                                     quantity == Quantity::dimensionless ? "" : " ",
                                     quantity == Quantity::dimensionless ? ""
                                     : si                                ? si_unit(quantity)
                                                                         : unit->suffix));
  }
  return *value;
}

double Settings::require_number(std::string_view path, Quantity quantity, double low, double high) const {
  if (!find_number(path, quantity)) {
    throw Error::in_file(state_->source, 0,
                         quantity == Quantity::dimensionless
                             ? fmt::format("no key '{}'", path)
                             : fmt::format("no key '{}_{}'", path, si_suffix(quantity).suffix));
  }
  return number(path, quantity, 0, low, high);
}

std::vector<double> Settings::numbers(std::string_view path, Quantity quantity, std::vector<double> fallback) const {
  const auto [table, name] = split_path(path);
  state_->learn(quantity == Quantity::dimensionless ? std::string(path)
                                                    : fmt::format("{}_{}", path, si_suffix(quantity).suffix));
  const auto [entry, unit] = state_->find(table, name, quantity);
  if (!entry) return fallback;
  entry->used = true;
  const auto* values = std::get_if<Numbers>(&entry->value);
  if (!values) state_->fail(*entry, "must be an array of numbers");
  std::vector<double> out;
  for (const double v : *values) out.push_back(unit->to_si(v));
  return out;
}

long Settings::integer(std::string_view path, long fallback, long low, long high) const {
  const auto [table, name] = split_path(path);
  long value = fallback;
  assign_integer(table, name, value, low, high);
  return value;
}

bool Settings::flag(std::string_view path, bool fallback) const {
  const bool* v = state_->typed<bool>(path, "true or false");
  return v ? *v : fallback;
}

std::string Settings::text(std::string_view path, std::string_view fallback,
                           std::initializer_list<std::string_view> allowed) const {
  const std::string* v = state_->typed<std::string>(path, "text");
  if (!v) return std::string(fallback);
  if (allowed.size() > 0 && std::find(allowed.begin(), allowed.end(), *v) == allowed.end()) {
    std::string list;
    for (const std::string_view a : allowed) list.append(list.empty() ? "" : ", ").append(a);
    throw error(path, "must be one of " + list);
  }
  return *v;
}

std::vector<std::string> Settings::texts(std::string_view path, std::vector<std::string> fallback) const {
  const auto* v = state_->typed<Texts>(path, "an array of texts");
  return v ? *v : fallback;
}

bool Settings::has(std::string_view path) const {
  const auto [table, name] = split_path(path);
  return std::any_of(state_->entries.begin(), state_->entries.end(), [&, t = table, n = name](const Entry& e) {
    return e.table == t && (e.key == n || split_unit(e.key).name == n);
  });
}

std::vector<std::string> Settings::keys(std::string_view path) const {
  std::vector<std::string> result;
  for (const Entry& e : state_->entries) {
    if (e.table == path) result.push_back(e.key);
  }
  return result;
}

std::vector<std::string> Settings::tables() const {
  std::vector<std::string> result;
  std::set<std::string_view> seen;
  for (const Entry& e : state_->entries)
    if (seen.insert(e.table).second) result.push_back(e.table);
  return result;
}

std::size_t Settings::count(std::string_view path) const {
  for (const auto& [name, size] : state_->arrays) {
    if (name == path) return size;
  }
  return 0;
}

bool Settings::assign(std::string_view table, std::string_view key, double& field, double unit) const {
  state_->learn(join(table, key));
  const NameWithUnit wanted = split_unit(key);
  if (!wanted.unit) {
    const Entry* e = state_->find_exact(table, key);
    if (e) field = state_->number_of(*e) * unit;
    return e != nullptr;
  }
  const auto [entry, given] = state_->find(table, wanted.name, wanted.unit->quantity);
  if (!entry) return false;
  const double value = state_->number_of(*entry);
  field = (entry->key == key ? value : wanted.unit->from_si(given->to_si(value))) * unit;
  return true;
}

bool Settings::assign(std::string_view table, std::string_view key, double& field) const {
  const UnitSuffix* unit = split_unit(key).unit;
  double value = 0;
  if (!assign(table, key, value, 1)) return false;
  field = unit ? unit->to_si(value) : value;
  return true;
}

bool Settings::assign(std::string_view table, std::string_view key, bool& field, double) const {
  const bool* v = state_->typed<bool>(join(table, key), "true or false");
  if (v) field = *v;
  return v != nullptr;
}

bool Settings::assign(std::string_view table, std::string_view key, std::string& field, double) const {
  const std::string* v = state_->typed<std::string>(join(table, key), "text");
  if (v) field = *v;
  return v != nullptr;
}

bool Settings::assign_integer(std::string_view table, std::string_view key, long& field, long low, long high) const {
  const std::string path = join(table, key);
  const long* v = state_->typed<long>(path, "a whole number");
  if (!v) return false;
  if (*v < low || *v > high) throw error(path, fmt::format("must be between {} and {}", low, high));
  field = *v;
  return true;
}

void Settings::finish() const {
  for (const Entry& e : state_->entries) {
    if (e.used) continue;
    std::string hint;
    if (const std::string near = nearest(e.path(), state_->known); !near.empty()) {
      hint = fmt::format("did you mean '{}'?", near);
    } else if (const auto below =
                   std::ranges::find(state_->known, e.key, [](auto& key) { return split_path(key).name; });
               e.table.empty() && below != state_->known.end()) {
      hint = fmt::format("it belongs under [{}]", split_path(*below).table);
    } else {
      for (const std::string& key : state_->known) {
        if (split_path(key).table == e.table)
          hint.append(hint.empty() ? "known here: " : ", ").append(split_path(key).name);
      }
      if (hint.empty()) hint = fmt::format("there is no table [{}]", e.table);
    }
    throw Error::in_file(state_->source, e.line, fmt::format("unknown key '{}'; {}", e.path(), hint));
  }
}

Error Settings::error(std::string_view path, std::string_view reason) const {
  const auto [table, name] = split_path(path);
  for (const Entry& e : state_->entries) {
    if (e.table == table && (e.key == name || split_unit(e.key).name == name)) {
      return Error::in_file(state_->source, e.line, fmt::format("{} = {}: {}", e.path(), e.shown, reason));
    }
  }
  return Error::in_file(state_->source, 0, fmt::format("{}: {}", path, reason));
}

const std::string& Settings::source() const { return state_->source; }

}  // namespace whirl::io
