#include "terms/term.hpp"

/// Runout of the probe's track, and a bow of the shaft, which is read alike.
namespace whirl::identification::terms {

const TermEntry& runout() {
  static const TermEntry entry{
      .label = "runout",
      .with =
          [](Growth g, int order, bool) {
            g.active.probes.runout_harmonics = order;
            return g;
          },
      .without = [](Growth g, int) -> std::optional<Growth> {
        if (g.bow) return std::nullopt;
        g.active.probes.runout_harmonics = 0;
        return g;
      },
      .columns =
          [](const ScorePoint& at) {
            Candidates out;
            Eigen::VectorXcd harmonic = at.carrier;
            for (int h = 1; h <= at.options.runout_harmonics; ++h) {
              if (h > at.active.probes.runout_harmonics) out.push_back({h, at.both_ways(harmonic)});
              harmonic = harmonic.cwiseProduct(at.carrier).eval();
            }
            return out;
          },
      .numbered = true,
      .plain_threshold = true,
      .hinted = false,
      .of_displacement = true,
  };
  return entry;
}

const TermEntry& bow() {
  // Beside the runout at order 1; tried where that is taken up.
  static const TermEntry entry{
      .label = "bow of the shaft",
      .with =
          [](Growth g, int, bool) {
            g.bow = true;
            return g;
          },
      .without = [](Growth g, int) -> std::optional<Growth> {
        g.bow = false;
        g.forces.clear();
        return g;
      },
      .columns = [](const ScorePoint&) { return Candidates{}; },
      .of_displacement = true,
  };
  return entry;
}

}  // namespace whirl::identification::terms
