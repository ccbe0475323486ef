#pragma once
#include <stdexcept>
#include <string>
#include <string_view>

namespace whirl {

/// Bad input or bad usage, found at a boundary (file, option, construction). Thrown once, caught once in `main`.
///
/// The message is one sentence that names the place (file and line, or field), the value found and what is allowed.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message) : std::runtime_error(message) {}

  /// Error at a place in a file. `line` counts from 1; 0 when the file as a whole is meant.
  static Error in_file(std::string_view file, long line, std::string_view message);

  /// Error of one field, e.g. an option: value found and what is allowed, both as text with their unit.
  static Error in_field(std::string_view field, std::string_view value, std::string_view allowed);
};

/// A table without a column that is needed: a caller may know another that will do.
class MissingColumn : public Error {
 public:
  MissingColumn(std::string column, const std::string& message) : Error(message), column_(std::move(column)) {}
  const std::string& column() const { return column_; }

 private:
  std::string column_;
};

/// Throws Error unless `value` is finite and inside [low, high].
void require_range(std::string_view field, double value, double low, double high, std::string_view unit = "");

}  // namespace whirl
