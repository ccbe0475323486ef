#include "terms/term.hpp"
#include "whirl/rotor/modal_response.hpp"

/// Modes beside the main one, forced by the unbalance.
namespace whirl::identification::terms {
namespace {

Eigen::VectorXcd half_grid_forcing(const AngleSignal& a) {
  Eigen::VectorXcd f(a.beta.size());
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    f[i] = std::polar(1.0, a.beta[i]) * Complex(a.omega[i] * a.omega[i], -a.alpha[i]);
  }
  return f;
}

}  // namespace

const TermEntry& mode() {
  static const TermEntry entry{
      .label = "mode",
      .with =
          [](Growth g, int place, bool poles) {
            const ForcedMode taken = g.mode(place).mode;
            g.start.modes.push_back(taken);
            for (detail::CandidateMode& c : g.modes)
              c.open = c.open && (c.above || std::abs(c.mode.omega / taken.omega - 1) >= 0.1);
            g.active.modes.poles = poles;
            return g;
          },
      .without = [](Growth, int) -> std::optional<Growth> { return std::nullopt; },
      .columns =
          [](const ScorePoint& at) {
            Candidates out;
            const Eigen::VectorXcd forcing =
                at.options.modes.empty() ? Eigen::VectorXcd() : half_grid_forcing(at.own.angle);
            for (const ForcedMode& m : at.options.modes) {
              const Eigen::VectorXcd q =
                  rotor::modal_response(m.omega, m.zeta, forcing, at.record.dt, at.own.angle.omega[0]);
              out.push_back({static_cast<int>(out.size()) + 1, {at.error(at.own.eps * q)}});
            }
            return out;
          },
      .frequency = [](const Growth& g, int place) { return g.mode(place).mode.omega; },
      .numbered = true,
      .one_at_a_time = true,
      .plain_threshold = true,
      .hinted = false,
  };
  return entry;
}

const TermEntry& modes_above() {
  // One mode in the place of all; its frequency is tried.
  static const TermEntry entry{
      .label = "modes above the speeds",
      .with =
          [](Growth g, int place, bool) {
            g.active.modes.given = static_cast<int>(g.start.modes.size());
            g.start.modes.push_back(g.mode(place).mode);
            for (detail::CandidateMode& c : g.modes) c.open = c.open && !c.above;
            return g;
          },
      .without = [](Growth g, int) -> std::optional<Growth> {
        if (g.active.modes.given + 1 != static_cast<int>(g.start.modes.size())) return std::nullopt;
        g.start.modes.pop_back();
        g.active.modes.given = -1;
        std::ranges::find_if(g.modes, &detail::CandidateMode::above)->open = true;
        return g;
      },
      .columns = [](const ScorePoint&) { return Candidates{}; },  // scored as a mode
      .tries =
          [](const Growth& g) {
            std::vector<int> places;
            for (std::size_t k = 0; k < g.modes.size(); ++k)
              if (g.modes[k].above) places.push_back(static_cast<int>(k) + 1);
            return places;
          },
      .one_at_a_time = true,
      .hinted = false,
      .decider = Decider::free_decay,
  };
  return entry;
}

}  // namespace whirl::identification::terms
