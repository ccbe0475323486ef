#include "rules/rules.hpp"
#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& gain_drift() {
  // Probes and drivers that warm up. An unbalance that grows (fouling) reads alike but for the cubic spring.
  static const TermEntry entry{
      .label = "gain of the probes drifting in time",
      .parameters = {{"sensor_gain_drift", "1/s"}},
      .sensor = &SensorAxes::gain_drift,
      .reading =
          [](const ProbePoint& at) {
            SensorAxes drifts = at.sensor;
            drifts.gain_drift = 1;
            const Eigen::ArrayXd time = detail::drifted_gain(drifts, at.main.size(), {at.t0, at.dt}) - 1;
            Eigen::VectorXcd more = at.main;
            if (at.sensor.cubic != 0) more += at.sensor.cubic * detail::cubes(at.main);
            more.array() *= time;
            const detail::HighPass corner = detail::high_pass_of(at.sensor, at.dt);
            return read_by_both(at, corner.any() ? detail::high_passed(more, corner) : more);
          },
      .rare = true,
      .usual = [](const TermScale& s) { return rules::kGainDrift / s.seconds; },
      .prior = {rules::kRareTerm, rules::kEitherSign, rules::kAsLikelyAsNot},
      .decider = Decider::probes,
      .hidden_decider = "let the probes warm up before the run",
  };
  return entry;
}

}  // namespace whirl::identification::terms
