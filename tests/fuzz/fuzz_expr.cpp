// Symbolic terms: the printed form of any term that is read is read again.
#include <string>

#include "harness.hpp"
#include "whirl/expr/expr.hpp"
#include "whirl/expr/unit.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const std::string printed = expr::Expr::parse(bytes).str();
    require(only_errors([&] { expr::Expr::parse(printed); }));
  });
  only_errors([&] {
    const std::string printed = expr::Unit::parse(bytes).str();
    require(only_errors([&] { expr::Unit::parse(printed); }));
  });
}
