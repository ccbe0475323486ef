#include "whirl/signal/derivative.hpp"

#include <cmath>
#include <string>

#include "whirl/core/error.hpp"

namespace whirl::signal {

Eigen::VectorXd central_difference(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, int order) {
  if (order != 2 && order != 4 && order != 6) {
    throw Error::in_field("order of the central difference", std::to_string(order), "2, 4 or 6");
  }
  const Eigen::Index n = x.size() - order;
  if (n < 1) throw Error::in_field("samples to differentiate", std::to_string(x.size()), "more than the order");
  const auto at = [&](int offset) { return x.segment(order / 2 + offset, n); };
  switch (order) {
    case 2:
      return (at(1) - at(-1)) / (2 * dt);
    case 4:
      return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * dt);
    default:
      return (45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + (at(3) - at(-3))) / (60 * dt);
  }
}

}  // namespace whirl::signal
