#include "terms/term.hpp"

namespace whirl::identification::terms {

const TermEntry& decay() {
  // A mode that decays freely from the start of each record.
  static const TermEntry entry{
      .label = "decay",
      .with =
          [](Growth g, int place, bool poles) {
            detail::CandidateDecay& taken = g.decays[static_cast<std::size_t>(place - 1)];
            g.active.modes.decays.push_back(taken.mode);
            taken.open = false;
            g.active.modes.poles = poles;
            return g;
          },
      .without = [](Growth, int) -> std::optional<Growth> { return std::nullopt; },
      .columns =
          [](const ScorePoint& at) {
            Candidates out;
            for (const DecayingMode& m : at.options.decays) {
              const Complex pole(-m.zeta * m.omega, m.omega * std::sqrt(1 - m.zeta * m.zeta));
              Eigen::VectorXcd plus(at.own.main.size());
              for (Eigen::Index i = 0; i < plus.size(); ++i)
                plus[i] = std::exp(pole * (at.record.dt * static_cast<double>(i)));
              out.push_back({static_cast<int>(out.size()) + 1, at.both_ways(plus)});
            }
            return out;
          },
      .frequency = [](const Growth& g, int place) { return g.decays[static_cast<std::size_t>(place - 1)].mode.omega; },
      .numbered = true,
      .plain_threshold = true,
      .hinted = false,
  };
  return entry;
}

}  // namespace whirl::identification::terms
