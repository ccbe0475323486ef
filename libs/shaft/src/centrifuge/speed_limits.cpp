#include "whirl/shaft/centrifuge/speed_limits.hpp"

#include <algorithm>

#include "centrifuge/sensor_model.hpp"
#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr double kMachines = 0.99;  // part of the machines that stay below their limit, and of those that trip

double quantile_of(std::vector<double>& values, double part) {
  const auto at = static_cast<long>(part * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace

SpeedLimits speed_limits(const Rotor& rotor, const CentrifugeSetup& setup, const std::vector<double>& speeds,
                         double safety, int draws, unsigned seed) {
  require_range("safety", safety, 1, 1000);
  require_range("draws", draws, 100, 1000000);
  const CentrifugeModel model(rotor, setup, centrifuge_sensors(rotor, setup));
  std::mt19937_64 random(seed);
  std::vector<MatrixXd> per_unit;
  for (int d = 0; d < draws; ++d)
    per_unit.push_back(model.readings(draw_centrifuge(setup, model.sensors().size(), random), speeds).cwiseAbs());
  const Index sensors = per_unit.front().rows(), count = per_unit.front().cols();
  SpeedLimits limits{model.sensors(),
                     speeds,
                     MatrixXd(sensors, count),
                     MatrixXd(sensors, count),
                     Eigen::VectorXd::Constant(count, std::numeric_limits<double>::infinity()),
                     model.forward_criticals(speeds.empty() ? 1 : *std::ranges::max_element(speeds))};
  const double allowed = setup.allowed * setup.radius;
  std::vector<double> values(per_unit.size());
  for (Index s = 0; s < sensors; ++s)
    for (Index k = 0; k < count; ++k) {
      for (std::size_t d = 0; d < per_unit.size(); ++d) values[d] = per_unit[d](s, k);
      limits.expected(s, k) = allowed * quantile_of(values, 0.5);
      limits.trip(s, k) = safety * allowed * quantile_of(values, kMachines);
      const double least = quantile_of(values, 1 - kMachines);
      if (least > 0) limits.caught[k] = std::min(limits.caught[k], limits.trip(s, k) / (least * setup.radius));
    }
  return limits;
}

}  // namespace whirl::shaft
