#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& sensor_angle() {
  static const TermEntry entry{
      .label = "sensor angle",
      .parameters = {{"sensor_angle", "rad"}},
      .sensor = &SensorAxes::angle,
      .reading =
          [](const ProbePoint& at) {
            const detail::Lean own = detail::lean(at.sensor);
            return read_by_y(at, {own.y, -own.x}, at.signal);
          },
      .both_axes = true,
      .usual = [](const TermScale&) { return double{rules::kProbe}; },
      .decider = Decider::probes,
  };
  return entry;
}

}  // namespace whirl::identification::terms
