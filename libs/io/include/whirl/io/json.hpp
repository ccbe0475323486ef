#pragma once
#include <Eigen/Core>
#include <complex>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/core/estimate.hpp"
#include "whirl/core/summary.hpp"

namespace whirl::io {

/// A JSON value. Objects keep the order in which keys were added. Numbers are doubles and survive a round
/// trip exactly; NaN and infinity are written as null.
class Json {
 public:
  using Array = std::vector<Json>;
  using Object = std::vector<std::pair<std::string, Json>>;

  Json() = default;
  Json(bool v) : value_(v) {}
  Json(double v) : value_(v) {}
  Json(int v) : value_(static_cast<double>(v)) {}
  Json(long v) : value_(static_cast<double>(v)) {}
  Json(const char* v) : value_(std::string(v)) {}
  Json(std::string_view v) : value_(std::string(v)) {}
  Json(std::string v) : value_(std::move(v)) {}
  Json(Array v) : value_(std::move(v)) {}
  Json(Object v) : value_(std::move(v)) {}
  Json(const std::vector<double>& v);
  Json(const std::vector<std::string>& v);
  Json(const Eigen::Ref<const Eigen::VectorXd>& v);
  static Json object() { return Json(Object{}); }
  static Json array() { return Json(Array{}); }

  /// Adds or replaces a key of an object (a null value becomes an object). Returns *this.
  Json& set(std::string key, Json value);
  /// Appends to an array (a null value becomes an array). Returns *this.
  Json& push(Json value);
  const Json* find(std::string_view key) const;
  template <class T>
  const T* get() const {
    return std::get_if<T>(&value_);
  }
  bool is_null() const { return value_.index() == 0; }
  std::string_view type_name() const;

  /// Text with two-space indent; arrays of plain values stay on one line.
  std::string dump() const;

 private:
  std::variant<std::monostate, bool, double, std::string, Array, Object> value_;
};

/// Parses JSON text; throws Error with file, line and reason when it is damaged or nested deeper than 64.
Json parse_json(std::string_view text, std::string_view source);

/// A place in a JSON document: value, file and path, so that every refusal can say where. The document must
/// outlive it.
class JsonReader {
 public:
  JsonReader(const Json& value, std::string source, std::string path = "$")
      : value_(&value), source_(std::move(source)), path_(std::move(path)) {}

  /// Throws Error unless the document says `schema` "name/n" with n <= version; tells a newer version from a
  /// wrong file.
  void require_schema(std::string_view name, int version) const;

  bool has(std::string_view key) const;  ///< present and not null
  JsonReader at(std::string_view key) const;
  std::vector<JsonReader> items() const;                            ///< of an array
  std::vector<std::pair<std::string, JsonReader>> members() const;  ///< of an object
  double number() const;                                            ///< finite
  double number_or_nan() const;                                     ///< null reads as NaN
  long integer() const;
  bool flag() const;
  const std::string& text() const;
  /// Text of one of the kinds of `core/names.hpp`; any other is refused with the rule.
  const std::string& identifier() const;
  const std::string& left_side() const;
  const std::string& label() const;
  const std::string& unit() const;
  /// The key of this member, of the kind that a model's parameters have: `is_label`.
  void require_label(std::string_view key) const;
  std::vector<double> numbers() const;
  Eigen::VectorXd vector() const;
  std::complex<double> complex() const;        ///< [re, im]
  Error error(std::string_view reason) const;  ///< "file: $.path: reason"
  const std::string& path() const { return path_; }

 private:
  const Json* value_;
  std::string source_;
  std::string path_;
};

/// The parts that every result file shares.
Json to_json(const Summary& summary);
Json to_json(const Provenance& provenance);
Json to_json(std::complex<double> z);  ///< [re, im]
/// {value, sd, ci95: [low, high], unit}; the unit is left out when empty.
Json to_json(const Estimate& estimate, std::string_view unit);
Summary read_summary(const JsonReader& in);
Provenance read_provenance(const JsonReader& in);
Estimate read_estimate(const JsonReader& in);

/// A document of the given schema, e.g. start_document("whirl.validation", 1).
Json start_document(std::string_view schema, int version);
void save_json(const std::filesystem::path& path, const Json& document);
Json load_json(const std::filesystem::path& path);

}  // namespace whirl::io

namespace whirl {
using io::to_json;  // of the values of core: found by their namespace
}
