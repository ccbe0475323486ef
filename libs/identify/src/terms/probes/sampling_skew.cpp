#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& sampling_skew() {
  // Converters differ, from microseconds to a sample: no size is usual.
  static const TermEntry entry{
      .label = "sampling skew",
      .parameters = {{"sensor_skew", "s"}},
      .sensor = &SensorAxes::skew,
      .reading =
          [](const ProbePoint& at) {
            const detail::Lean own = detail::lean(at.sensor);
            const Eigen::VectorXd y = own.y * at.signal.imag() + own.x * at.signal.real();
            Eigen::VectorXcd out = Eigen::VectorXcd::Zero(y.size());
            out.imag() = detail::later_rate(y, at.sensor.skew / at.dt) / at.dt;
            return out;
          },
      .both_axes = true,
  };
  return entry;
}

}  // namespace whirl::identification::terms
