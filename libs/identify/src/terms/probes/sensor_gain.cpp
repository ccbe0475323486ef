#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& sensor_gain() {
  static const TermEntry entry{
      .label = "sensor gain",
      .parameters = {{"sensor_gain", ""}},
      .sensor = &SensorAxes::gain,
      .reading =
          [](const ProbePoint& at) {
            const detail::Lean own = detail::lean(at.sensor);
            const double gain = 1 + at.sensor.gain;
            return read_by_y(at, {own.x / gain, own.y / gain}, at.signal);
          },
      .both_axes = true,
      .usual = [](const TermScale&) { return double{rules::kProbe}; },
      .decider = Decider::probes,
  };
  return entry;
}

}  // namespace whirl::identification::terms
