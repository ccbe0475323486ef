#include <fmt/format.h>

#include "whirl/core/names.hpp"
#include "whirl/io/json.hpp"

namespace whirl::io {
namespace {

void require_name(const JsonReader& reader, std::string_view value, bool allowed, std::string_view rule) {
  if (!allowed) throw reader.error(fmt::format("'{}': {}", one_line(value.substr(0, 60)), rule));
}

}  // namespace

const std::string& JsonReader::identifier() const {
  require_name(*this, text(), is_identifier(text()), kIdentifierRule);
  return text();
}

const std::string& JsonReader::left_side() const {
  require_name(*this, text(), is_left_side(text()), kLeftSideRule);
  return text();
}

const std::string& JsonReader::label() const {
  require_name(*this, text(), is_label(text()), kLabelRule);
  return text();
}

const std::string& JsonReader::unit() const {
  require_name(*this, text(), is_unit_text(text()), kUnitRule);
  return text();
}

void JsonReader::require_label(std::string_view key) const { require_name(*this, key, is_label(key), kLabelRule); }

}  // namespace whirl::io
