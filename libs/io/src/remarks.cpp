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

void remark(const std::string& file, const std::string& text) {
  if (handler()) handler()(file, text);
}

}  // namespace whirl::io
