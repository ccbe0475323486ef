#include "whirl/io/remarks.hpp"

#include <utility>

namespace whirl::io {
namespace {

RemarkHandler& handler() {
  static RemarkHandler current;
  return current;
}

}  // namespace

RemarkHandler set_remark_handler(RemarkHandler next) { return std::exchange(handler(), std::move(next)); }

void remark(const std::string& file, const std::string& text, RemarkCode code) {
  if (handler()) handler()(file, text, code);
}

std::string_view to_string(RemarkCode code) { return code == RemarkCode::open_last_line ? "open_last_line" : "other"; }

bool is_information(RemarkCode code) { return code == RemarkCode::open_last_line; }

}  // namespace whirl::io
