#include "whirl/io/json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>

#include "whirl/core/names.hpp"
#include "whirl/io/file.hpp"

namespace whirl::io {
namespace {

constexpr std::size_t kDepth = 64;

std::string json_quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string number_text(double v) {
  if (!std::isfinite(v)) return "null";
  if (v == 0 && std::signbit(v)) return "-0.0";  // "-0" would be read as the integer 0
  char out[32];
  return {out, std::to_chars(out, out + sizeof out, v).ptr};
}

/// Builds a Json from parser events, so that duplicate keys and deep nesting are refused (nlohmann::ordered_json takes
/// both); the parser's own header stays out of every header of ours.
struct Builder : nlohmann::json_sax<nlohmann::json> {
  struct Level {
    Json value;
    std::string key;  // of the member to come
  };
  std::vector<Level> stack;
  Json root;
  std::string_view text;
  std::string problem;
  std::size_t position = 0;

  /// Where the value to come stands, as JsonReader names it.
  std::string path() const {
    std::string out = "$";
    for (const Level& level : stack) {
      const auto* array = level.value.get<Json::Array>();
      out += array != nullptr ? fmt::format("[{}]", array->size()) : "." + level.key;
    }
    return out;
  }
  /// The word of the text around its character `at` - 1.
  std::string word(std::size_t at) const {
    constexpr std::string_view kEnds = " \t\r\n,:[]{}\"";
    if (at == 0 || at > text.size()) return {};
    const std::size_t before = text.find_last_of(kEnds, at - 1), end = text.find_first_of(kEnds, at - 1);
    const std::size_t start = before == std::string_view::npos ? 0 : before + 1;
    return start < end ? std::string(text.substr(start, std::min(end - start, std::size_t{40}))) : std::string{};
  }

  bool add(Json value) {
    if (stack.empty()) {
      root = std::move(value);
    } else if (stack.back().value.get<Json::Object>()) {
      stack.back().value.set(std::move(stack.back().key), std::move(value));
    } else {
      stack.back().value.push(std::move(value));
    }
    return true;
  }
  bool open(Json value) {
    if (stack.size() >= kDepth) {
      problem = fmt::format("nested deeper than {} levels", kDepth);
      return false;
    }
    stack.push_back({std::move(value), {}});
    return true;
  }
  bool close() {
    Json value = std::move(stack.back().value);
    stack.pop_back();
    return add(std::move(value));
  }

  bool null() override { return add({}); }
  bool boolean(bool v) override { return add(v); }
  bool number_integer(number_integer_t v) override { return add(static_cast<double>(v)); }
  bool number_unsigned(number_unsigned_t v) override { return add(static_cast<double>(v)); }
  bool number_float(number_float_t v, const string_t&) override { return add(v); }
  bool string(string_t& v) override { return add(std::move(v)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool key(string_t& v) override {
    if (stack.back().value.find(v)) {
      problem = fmt::format("key '{}' is there twice", v);
      return false;
    }
    stack.back().key = std::move(v);
    return true;
  }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_array() override { return close(); }
  bool parse_error(std::size_t at, const std::string& token, const nlohmann::json::exception&) override {
    position = at;
    // strtod knows what other programs write for a number that is none: NaN, -Infinity, 1e999.
    if (const std::string value = word(at); !value.empty()) {
      char* end = nullptr;
      const double number = std::strtod(value.c_str(), &end);
      if (*end == '\0' && !std::isfinite(number)) {
        problem = fmt::format("{} = {}: must be a finite number", path(), value);
        return false;
      }
    }
    problem = token.empty() ? "unexpected end or character" : fmt::format("unexpected '{}'", token.substr(0, 40));
    return false;
  }
};

bool is_plain(const Json& v) { return !v.get<Json::Array>() && !v.get<Json::Object>(); }

void dump_value(const Json& v, int indent, std::string& out) {
  if (const auto* object = v.get<Json::Object>()) {
    if (object->empty()) {
      out += "{}";
      return;
    }
    out += '{';
    for (const auto& [key, value] : *object) {
      out += &key == &object->front().first ? "\n" : ",\n";
      out.append(static_cast<std::size_t>(indent + 2), ' ').append(json_quoted(key)).append(": ");
      dump_value(value, indent + 2, out);
    }
    out.append("\n").append(static_cast<std::size_t>(indent), ' ') += '}';
  } else if (const auto* array = v.get<Json::Array>()) {
    const bool one_line = std::all_of(array->begin(), array->end(), is_plain);
    out += '[';
    for (const Json& item : *array) {
      if (&item != &array->front()) out += one_line ? ", " : ",";
      if (!one_line) out.append("\n").append(static_cast<std::size_t>(indent + 2), ' ');
      dump_value(item, indent + 2, out);
    }
    if (!one_line) out.append("\n").append(static_cast<std::size_t>(indent), ' ');
    out += ']';
  } else if (const auto* text = v.get<std::string>()) {
    out += json_quoted(*text);
  } else if (const auto* number = v.get<double>()) {
    out += number_text(*number);
  } else if (const auto* flag = v.get<bool>()) {
    out += *flag ? "true" : "false";
  } else {
    out += "null";
  }
}

}  // namespace

Json::Json(const std::vector<double>& v) : value_(Array(v.begin(), v.end())) {}
Json::Json(const std::vector<std::string>& v) : value_(Array(v.begin(), v.end())) {}
Json::Json(const Eigen::Ref<const Eigen::VectorXd>& v) : value_(Array(v.data(), v.data() + v.size())) {}

Json& Json::set(std::string key, Json value) {
  if (is_null()) value_ = Object{};
  Object& object = std::get<Object>(value_);
  for (auto& [k, v] : object) {
    if (k == key) {
      v = std::move(value);
      return *this;
    }
  }
  object.emplace_back(std::move(key), std::move(value));
  return *this;
}

Json& Json::push(Json value) {
  if (is_null()) value_ = Array{};
  std::get<Array>(value_).push_back(std::move(value));
  return *this;
}

const Json* Json::find(std::string_view key) const {
  if (const auto* object = get<Object>()) {
    for (const auto& [k, v] : *object) {
      if (k == key) return &v;
    }
  }
  return nullptr;
}

std::string_view Json::type_name() const {
  constexpr std::string_view names[] = {"null", "true or false", "a number", "text", "an array", "an object"};
  return names[value_.index()];
}

std::string Json::dump() const {
  std::string out;
  dump_value(*this, 0, out);
  return out;
}

Json parse_json(std::string_view text, std::string_view source) {
  Builder builder;
  builder.text = text;
  if (!nlohmann::json::sax_parse(text, &builder) || !builder.problem.empty()) {
    const std::string_view head = text.substr(0, std::min(text.find('\n'), std::size_t{200}));
    if (!head.empty() && std::isalpha(static_cast<unsigned char>(head[0])) != 0 && head.find(',') != text.npos) {
      throw Error::in_file(
          source, 1,
          fmt::format("is a table in CSV ('{}'), not a JSON result of whirl; are two files in each other's place?",
                      head.substr(0, 40)));
    }
    const std::string_view before = text.substr(0, builder.position);
    const long line = builder.position == 0 ? 0 : 1 + std::count(before.begin(), before.end(), '\n');
    throw Error::in_file(source, line, "damaged JSON: " + builder.problem);
  }
  return std::move(builder.root);
}

Error JsonReader::error(std::string_view reason) const {
  return Error(fmt::format("{}: {}: {}", source_, one_line(path_), reason));
}

namespace {

template <class T>
const T& expect(const JsonReader& reader, const Json& value, std::string_view wanted) {
  if (const T* v = value.get<T>()) return *v;
  throw reader.error(fmt::format("is {}, must be {}", value.type_name(), wanted));
}

/// The command that writes a schema of this name.
std::string_view maker_of(std::string_view name) {
  static constexpr std::pair<std::string_view, std::string_view> kMakers[] = {
      {"whirl.model", "whirl identify"}, {"whirl.controller", "whirl design"}, {"whirl.stiffness", "whirl stiffness"},
      {"whirl.modes", "whirl modes"},    {"whirl.frf", "whirl frf"},           {"whirl.margins", "whirl margins"},
  };
  for (const auto& [schema, command] : kMakers) {
    if (schema == name) return command;
  }
  return {};
}

}  // namespace

void JsonReader::require_schema(std::string_view name, int version) const {
  const Json* schema = value_->find("schema");
  const std::string* text = schema ? schema->get<std::string>() : nullptr;
  if (!text) throw error(fmt::format("no key 'schema': this is not a {} file", name));
  const std::size_t slash = text->rfind('/');
  int found = 0;
  const char* const end = text->data() + text->size();
  if (slash == std::string::npos || text->substr(0, slash) != name ||
      std::from_chars(text->data() + slash + 1, end, found).ptr != end || found < 1) {
    const std::string_view maker = maker_of(name);
    throw error(fmt::format("schema '{}', must be '{}/{}'{}; are two files in each other's place?", text->substr(0, 60),
                            name, version, maker.empty() ? "" : fmt::format(" (written by `{}`)", maker)));
  }
  if (found > version) {
    throw error(
        fmt::format("schema '{}' was written by a newer program; this one reads up to '{}/{}'", *text, name, version));
  }
}

bool JsonReader::has(std::string_view key) const {
  const Json* v = value_->find(key);
  return v && !v->is_null();
}

JsonReader JsonReader::at(std::string_view key) const {
  expect<Json::Object>(*this, *value_, "an object");
  const Json* v = value_->find(key);
  if (!v) throw error(fmt::format("no key '{}'", key));
  return {*v, source_, fmt::format("{}.{}", path_, key)};
}

std::vector<JsonReader> JsonReader::items() const {
  std::vector<JsonReader> out;
  for (const Json& v : expect<Json::Array>(*this, *value_, "an array")) {
    out.emplace_back(v, source_, fmt::format("{}[{}]", path_, out.size()));
  }
  return out;
}

std::vector<std::pair<std::string, JsonReader>> JsonReader::members() const {
  std::vector<std::pair<std::string, JsonReader>> out;
  for (const auto& [key, v] : expect<Json::Object>(*this, *value_, "an object")) {
    out.emplace_back(key, JsonReader(v, source_, fmt::format("{}.{}", path_, key)));
  }
  return out;
}

double JsonReader::number() const {
  const double v = expect<double>(*this, *value_, "a finite number");
  if (!std::isfinite(v)) throw error("is not finite");
  return v;
}
double JsonReader::number_or_nan() const {
  return value_->is_null() ? std::numeric_limits<double>::quiet_NaN() : number();
}
long JsonReader::integer() const {
  const double v = number();
  if (v != std::floor(v) || std::abs(v) > 9007199254740992.0) throw error(fmt::format("{} is not an integer", v));
  return static_cast<long>(v);
}
bool JsonReader::flag() const { return expect<bool>(*this, *value_, "true or false"); }
const std::string& JsonReader::text() const { return expect<std::string>(*this, *value_, "text"); }

std::vector<double> JsonReader::numbers() const {
  const auto& array = expect<Json::Array>(*this, *value_, "an array of numbers");
  std::vector<double> out;
  out.reserve(array.size());
  for (const Json& v : array) {
    const double* number = v.get<double>();
    if (!number || !std::isfinite(*number)) {
      throw error(fmt::format("[{}] is {}, must be a finite number", out.size(), v.type_name()));
    }
    out.push_back(*number);
  }
  return out;
}

Eigen::VectorXd JsonReader::vector() const {
  const std::vector<double> v = numbers();
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

std::complex<double> JsonReader::complex() const {
  const std::vector<double> v = numbers();
  if (v.size() != 2) throw error("must be [re, im]");
  return {v[0], v[1]};
}

Json to_json(std::complex<double> z) { return Json::array().push(z.real()).push(z.imag()); }

Json to_json(const Estimate& e, std::string_view unit) {
  Json out;
  out.set("value", e.value).set("sd", e.sd).set("ci95", Json::array().push(e.low).push(e.high));
  if (!unit.empty()) out.set("unit", unit);
  return out;
}

Estimate read_estimate(const JsonReader& in) {
  Estimate e;
  e.value = in.at("value").number_or_nan();
  if (in.has("sd")) e.sd = in.at("sd").number();
  const std::vector<JsonReader> ends = in.at("ci95").items();
  if (ends.size() != 2) throw in.at("ci95").error("must be [low, high]");
  e.low = ends[0].number_or_nan();
  e.high = ends[1].number_or_nan();
  return e;
}

Json to_json(const Provenance& p) {
  Json out;
  // A seed is a 64-bit integer; JSON numbers hold 53 bits, so it is text.
  out.set("version", p.version).set("inputs", p.inputs).set("options", p.options).set("seed", std::to_string(p.seed));
  return out;
}

Provenance read_provenance(const JsonReader& in) {
  Provenance p;
  p.version = one_line(in.at("version").text());
  for (const JsonReader& i : in.at("inputs").items()) p.inputs.push_back(one_line(i.text()));
  p.options = one_line(in.at("options").text());
  const JsonReader seed = in.at("seed");
  const std::string& digits = seed.text();
  const auto [end, ec] = std::from_chars(digits.data(), digits.data() + digits.size(), p.seed);
  if (ec != std::errc{} || end != digits.data() + digits.size()) throw seed.error("must be a whole number as text");
  return p;
}

Json start_document(std::string_view schema, int version) {
  return std::move(Json::object().set("schema", fmt::format("{}/{}", schema, version)));
}

void save_json(const std::filesystem::path& path, const Json& document) { write_text(path, document.dump() + "\n"); }
Json load_json(const std::filesystem::path& path) { return parse_json(read_text(path), path.string()); }

}  // namespace whirl::io
