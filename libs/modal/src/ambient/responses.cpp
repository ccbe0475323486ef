#include "responses.hpp"

#include <fmt/format.h>

#include "whirl/core/error.hpp"

namespace whirl::modal {

Eigen::MatrixXd responses_of(const Recording& recording, OperationalModes& result) {
  Eigen::MatrixXd y(recording.size(), 0);
  for (const Channel& c : recording.channels) {
    if (c.quantity == Quantity::time || c.quantity == Quantity::force || c.quantity == Quantity::angle ||
        c.quantity == Quantity::angular_velocity)
      continue;
    if (y.cols() > 0 && c.quantity != recording.at(result.channels.front()).quantity) {
      throw Error(fmt::format("{}: channel '{}' shows {}: all must be one quantity", recording.source, c.name,
                              to_string(c.quantity)));
    }
    if (c.samples.maxCoeff() == c.samples.minCoeff()) {
      result.summary.warn(fmt::format("channel '{}' never changes: left out", c.name));
      continue;
    }
    y.conservativeResize(Eigen::NoChange, y.cols() + 1);
    y.col(y.cols() - 1) = c.samples.array() - c.samples.mean();
    result.channels.push_back(c.name);
  }
  if (y.cols() == 0) throw Error(fmt::format("{}: no response channel", recording.source));
  return y;
}

}  // namespace whirl::modal
