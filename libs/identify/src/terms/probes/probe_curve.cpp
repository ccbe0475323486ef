#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& probe_curve() {
  static const TermEntry entry{
      .label = "probe curve",
      .parameters = {{"sensor_cubic", "1/m^2"}},
      .sensor = &SensorAxes::cubic,
      .reading =
          [](const ProbePoint& at) {
            const detail::HighPass corner = detail::high_pass_of(at.sensor, at.dt);
            const Eigen::VectorXcd bent = detail::cubes(at.main);
            return read_by_both(at, corner.any() ? detail::high_passed(bent, corner) : bent);
          },
      .of_displacement = true,
      .usual = [](const TermScale& s) { return rules::kProbeCurve / (s.peak * s.peak); },
      .hidden_decider = "calibrate the probes over the whole orbit",
  };
  return entry;
}

}  // namespace whirl::identification::terms
