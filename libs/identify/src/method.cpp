#include <string>
#include <string_view>
#include <utility>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/signal/motion_quantity.hpp"

namespace whirl::identification {
namespace {

constexpr std::pair<Method, std::string_view> kMethods[] = {{Method::automatic, "automatic"},
                                                            {Method::weak, "weak"},
                                                            {Method::paper, "paper"},
                                                            {Method::consistent, "consistent"},
                                                            {Method::second_order, "second-order"},
                                                            {Method::sindy, "sindy"},
                                                            {Method::drive, "drive"}};

bool shows(const Recording& like, const std::string& name, Quantity quantity) {
  const Channel* c = like.find(name);
  return c != nullptr && c->quantity == quantity;
}

bool shows_motion(const Recording& like, const std::string& name) {
  const Channel* c = like.find(name);
  return c != nullptr && signal::integrations(c->quantity, Quantity::displacement).has_value();
}

}  // namespace

std::string_view to_string(Method method) {
  for (const auto& [value, name] : kMethods) {
    if (value == method) return name;
  }
  return "?";
}

Method method_of(const std::string& name) {
  for (const auto& [value, text] : kMethods) {
    if (text == name) return value;
  }
  throw Error::in_field("method", name, "automatic, weak, paper, consistent, second-order, sindy or drive");
}

Method IdentifyOptions::chosen(const Recording& like) const {
  if (method != Method::automatic) return method;
  // A rotor: its angle and the motion along one direction at least.
  const bool turns =
      like.has(rotor.record.angle) && ((like.has(rotor.record.x) && like.has(rotor.record.y)) ||
                                       (shows(like, rotor.record.angle, Quantity::angle) &&
                                        (shows_motion(like, rotor.record.x) || shows_motion(like, rotor.record.y))));
  const bool asks = library || !sindy.states.empty() || !sindy.inputs.empty() || !sindy.library.empty();
  return !asks && turns ? Method::weak : Method::sindy;
}

}  // namespace whirl::identification
