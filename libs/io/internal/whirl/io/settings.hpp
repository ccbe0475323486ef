#pragma once
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/core/quantity.hpp"

namespace whirl::io {

/// Settings from a TOML file, addressed by dotted path without unit: `[rotor] mass_kg = 1.5` is "rotor.mass".
/// Entry i of an array of tables `[[fault]]` is "fault[0].start".
///
/// A number with a dimension carries its unit in its key and is returned in SI. Every getter marks its key as
/// known; `finish()` refuses what no getter asked for. Errors name file, line, key, value and what is
/// allowed.
class Settings {
 public:
  Settings();  ///< empty: every getter returns its fallback
  ~Settings();
  Settings(Settings&&) noexcept;
  Settings& operator=(Settings&&) noexcept;

  /// Number in SI. A dimensionless one needs no suffix.
  double number(std::string_view path, Quantity quantity, double fallback, double low = -kInfinity,
                double high = kInfinity) const;
  std::optional<double> find_number(std::string_view path, Quantity quantity) const;
  /// As `number`, but the key must be present.
  double require_number(std::string_view path, Quantity quantity, double low = -kInfinity,
                        double high = kInfinity) const;
  /// Array of numbers in SI.
  std::vector<double> numbers(std::string_view path, Quantity quantity, std::vector<double> fallback) const;
  long integer(std::string_view path, long fallback, long low = std::numeric_limits<long>::min(),
               long high = std::numeric_limits<long>::max()) const;
  bool flag(std::string_view path, bool fallback) const;
  /// Text; when `allowed` is not empty it must be one of these.
  std::string text(std::string_view path, std::string_view fallback,
                   std::initializer_list<std::string_view> allowed = {}) const;
  std::vector<std::string> texts(std::string_view path, std::vector<std::string> fallback) const;

  bool has(std::string_view path) const;
  /// Keys of the table `path` as written, in the order of the file.
  std::vector<std::string> keys(std::string_view path) const;
  /// Full names of the tables that hold keys, in the order of the file.
  std::vector<std::string> tables() const;
  /// Number of tables in the array of tables `path`.
  std::size_t count(std::string_view path) const;

  /// Sets `field` from the key "table.key" if it is present and returns whether it was. `key` carries the
  /// unit in which the field is documented and field = value in that unit * `unit`; the file may use any
  /// other unit of the same quantity (`mass_gram` for the key `mass_kg`).
  bool assign(std::string_view table, std::string_view key, double& field, double unit) const;
  /// The same for a field in the SI unit of the key's quantity (Hz for `_hz`; use `unit` for a field in
  /// rad/s).
  bool assign(std::string_view table, std::string_view key, double& field) const;
  bool assign(std::string_view table, std::string_view key, bool& field, double = 1) const;
  bool assign(std::string_view table, std::string_view key, std::string& field, double = 1) const;
  template <class Integer>
  requires std::is_integral_v<Integer>
  bool assign(std::string_view table, std::string_view key, Integer& field, double = 1) const {
    long value = static_cast<long>(field);
    if (!assign_integer(table, key, value, static_cast<long>(std::numeric_limits<Integer>::min()),
                        sizeof(Integer) < sizeof(long) ? static_cast<long>(std::numeric_limits<Integer>::max())
                                                       : std::numeric_limits<long>::max())) {
      return false;
    }
    field = static_cast<Integer>(value);
    return true;
  }

  /// Throws Error for the first key that no getter asked for, with the nearest known name.
  void finish() const;
  /// "file:line: key = value: reason" for a value that a caller refuses.
  Error error(std::string_view path, std::string_view reason) const;
  const std::string& source() const;

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  friend Settings parse_settings(std::string_view text, std::string_view name);
  bool assign_integer(std::string_view table, std::string_view key, long& field, long low, long high) const;
  struct State;
  std::unique_ptr<State> state_;
};

Settings read_settings(const std::filesystem::path& path);
/// From text; `name` stands in messages.
Settings parse_settings(std::string_view text, std::string_view name);

/// Applies the settings to an object that lists its fields with `visit_fields(object, visitor)`, which calls
/// `visitor("table.key_unit", field, unit)` with SI value = file value * unit.
template <class T>
void apply(const Settings& settings, T& object) {
  visit_fields(object, [&](std::string_view full_key, auto& field, double unit) {
    const std::size_t dot = full_key.rfind('.');
    settings.assign(dot == std::string_view::npos ? std::string_view{} : full_key.substr(0, dot),
                    full_key.substr(dot + 1), field, unit);
  });
}

/// One line of a TOML file to be written.
struct TomlEntry {
  std::string table;                                                         ///< "" for the top level
  std::string key;                                                           ///< with unit suffix
  std::variant<double, long, bool, std::string, std::vector<double>> value;  ///< in the unit of the key
  std::string comment;
};
/// TOML text, tables in the order of their first entry. Doubles with every digit needed to read them back.
std::string to_toml(const std::vector<TomlEntry>& entries);

/// Any text as a TOML string or quoted key, and as the rest of a comment's line.
std::string toml_quoted(std::string_view text);
std::string toml_comment(std::string_view text);

}  // namespace whirl::io
