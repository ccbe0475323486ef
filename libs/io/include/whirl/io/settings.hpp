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

namespace whirl {

/// Settings from a TOML file, addressed by dotted path without unit: `[rotor] mass_kg = 1.5` is "rotor.mass".
/// Entry i of an array of tables `[[fault]]` is "fault[0].start".
///
/// A number with a dimension carries its unit in its key and is returned in SI. Every getter marks its key as known;
/// `finish()` refuses what no getter asked for. Errors name file, line, key, value and what is allowed.
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
  /// Number of tables in the array of tables `path`.
  std::size_t count(std::string_view path) const;

  /// Sets `field` from the key "table.key" if it is present. `key` carries the unit of the field's documentation
  /// (`mass_kg`); the file may use any other unit of that quantity (`mass_gram`). Returns whether it was present.
  bool assign(std::string_view table, std::string_view key, double& field) const;
  bool assign(std::string_view table, std::string_view key, bool& field) const;
  bool assign(std::string_view table, std::string_view key, std::string& field) const;
  bool assign(std::string_view table, std::string_view key, std::vector<double>& field) const;
  template <class Integer>
    requires std::is_integral_v<Integer>
  bool assign(std::string_view table, std::string_view key, Integer& field) const {
    long value = 0;
    if (!assign_integer(table, key, value, std::is_unsigned_v<Integer>)) return false;
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
  bool assign_integer(std::string_view table, std::string_view key, long& field, bool is_unsigned) const;
  struct State;
  std::unique_ptr<State> state_;
};

Settings read_settings(const std::filesystem::path& path);
/// From text; `name` stands in messages.
Settings parse_settings(std::string_view text, std::string_view name);

/// Applies the keys of one table to an object that lists its fields with
/// `visit_fields(object, visitor)` calling `visitor(key_with_unit, field)`.
template <class T>
void apply(const Settings& settings, std::string_view table, T& object) {
  visit_fields(object, [&](std::string_view key, auto& field) { settings.assign(table, key, field); });
}

/// One line of a TOML file to be written.
struct TomlEntry {
  std::string table;  ///< "" for the top level
  std::string key;    ///< with unit suffix
  std::variant<double, long, bool, std::string, std::vector<double>> value;  ///< in the unit of the key
  std::string comment;
};
/// TOML text; entries of one table must stand together. Doubles with every digit needed to read them back.
std::string to_toml(const std::vector<TomlEntry>& entries);

}  // namespace whirl
