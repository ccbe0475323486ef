#include "whirl/control/method.hpp"
#include "whirl/deploy/code.hpp"

namespace whirl::deploy {

LawEquation law_equation(const std::string& law) {
  const control::LawEntry& entry = control::law_entry(law);
  return {entry.equation, entry.latex};
}

}  // namespace whirl::deploy
