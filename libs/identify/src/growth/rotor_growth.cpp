#include "growth/rotor_growth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/identify/score_test.hpp"

namespace whirl::identification::detail {
namespace {

using Complex = std::complex<double>;

constexpr std::size_t kMostSearched = 4;  // modes taken up before the search of unlisted ones ends

struct CandidateMode {
  ForcedMode mode;
  bool searched;  // not from the hammer test
};

/// Modes of the hammer test that are not the main one (within 3 % of it).
std::vector<CandidateMode> hammer_modes(const RotorIdentifyOptions& options, double main_frequency) {
  std::vector<CandidateMode> modes;
  if (!options.modal) return modes;
  for (const Mode& m : options.modal->modes) {
    const double w = 2 * std::numbers::pi * m.frequency.value;
    if (std::abs(w / main_frequency - 1) > 0.03) modes.push_back({{w, std::max(m.damping.value, 1e-5), 0}, false});
  }
  return modes;
}

/// Frequencies to search, a half-power width of 2 % damping apart, away from the main mode.
std::vector<CandidateMode> searched_modes(double top_speed, double main_frequency) {
  constexpr double kZeta = 0.02;
  std::vector<CandidateMode> modes;
  for (double w = 0.25 * top_speed; w < 1.4 * top_speed; w *= 1 + 2 * kZeta) {
    if (std::abs(w / main_frequency - 1) > 0.15) modes.push_back({{w, kZeta, 0}, true});
  }
  return modes;
}

/// The state of the growing model.
struct Growth {
  OutputErrorOptions active;
  RotorModel start;
  double delay = 0;
  std::vector<CandidateMode> modes;  ///< not yet in the model
  std::vector<DecayingMode> decays;
};

Growth with_term(Growth g, const std::string& term, const RotorIdentifyOptions& options) {
  if (term == "conj z") {
    g.active.conj_stiffness = true;
  } else if (term == "conj z'") {
    g.active.conj_damping = true;
  } else if (term.starts_with("runout")) {
    g.active.runout_harmonics = term.back() - '0';
  } else if (term == "delay") {
    g.active.delay = true;
  } else {
    const auto k = static_cast<std::ptrdiff_t>(std::stoul(term.substr(term.find(' ') + 1)) - 1);
    if (term.starts_with("mode")) {
      const ForcedMode mode = g.modes[static_cast<std::size_t>(k)].mode;
      g.start.modes.push_back(mode);
      std::erase_if(g.modes, [&](const CandidateMode& c) { return std::abs(c.mode.omega / mode.omega - 1) < 0.1; });
    } else {
      g.active.decays.push_back(g.decays[static_cast<std::size_t>(k)]);
      g.decays.erase(g.decays.begin() + k);
    }
    g.active.poles = options.refine_poles;
  }
  return g;
}

/// Name for reports: modes and decays by their frequency.
std::string label(const std::string& term, const Growth& g) {
  if (!term.starts_with("mode") && !term.starts_with("decay")) return term;
  const std::size_t space = term.find(' '), k = std::stoul(term.substr(space + 1)) - 1;
  const double w = term.starts_with("mode") ? g.modes[k].mode.omega : g.decays[k].omega;
  return fmt::format("{} {:.4g} Hz", term.substr(0, space), w / (2 * std::numbers::pi));
}

/// Candidates to try next: the best one that the model can take up. Near resonance conj z and conj z' look alike, so
/// when both are significant the fit decides between them.
std::vector<std::string> next_terms(const ScoreTest& test, const Growth& growth,
                                    const std::vector<std::string>& refused, double threshold) {
  for (const ScoreCandidate& c : test.candidates) {
    if (!c.in_model || c.score < threshold || std::find(refused.begin(), refused.end(), c.term) != refused.end())
      continue;
    if (c.term.starts_with("mode") && c.score < 3 * threshold &&
        growth.modes[std::stoul(c.term.substr(5)) - 1].searched) {
      continue;
    }
    if (c.term.starts_with("conj z")) {
      const ScoreCandidate* other = test.find(c.term == "conj z" ? "conj z'" : "conj z");
      if (other != nullptr && other->score >= threshold) return {"conj z", "conj z'"};
    }
    return {c.term};
  }
  return {};
}

}  // namespace

GrownRotor grow_rotor(const std::vector<RotorRecord>& records, const RotorModel& start,
                      const std::vector<Complex>& start_eps, const OutputErrorOptions& active,
                      const RotorIdentifyOptions& options, bool search_modes) {
  const double main_frequency = std::sqrt(start.k1);
  Growth growth{active, start, 0, hammer_modes(options, main_frequency), {}};
  for (const CandidateMode& c : growth.modes) growth.decays.push_back({c.mode.omega, c.mode.zeta});
  if (search_modes) {
    double top = 0;
    for (const RotorRecord& r : records) top = std::max(top, r.speed_high());
    const std::vector<CandidateMode> more = searched_modes(top, main_frequency);
    growth.modes.insert(growth.modes.end(), more.begin(), more.end());
  }
  ScoreTestOptions score;
  score.half_width = options.half_width;
  score.runout_harmonics = options.runout_harmonics;
  score.delay = options.delay;

  GrownRotor grown;
  double values = 0;  // real readings
  for (const RotorRecord& r : records) values += 2 * static_cast<double>(r.size());
  std::vector<std::string> refused;
  std::vector<Complex> eps = start_eps;
  OutputErrorFit fit = fit_output_error_rotor(records, growth.start, growth.active, eps);
  for (;;) {
    grown.fit = std::move(fit);
    grown.active = growth.active;
    if (!grown.usable()) return grown;
    growth.start = grown.fit.model;
    growth.active.decays = grown.fit.decays;
    growth.delay = grown.fit.delay;
    for (std::size_t r = 0; r < eps.size(); ++r) eps[r] = grown.fit.records[r].eps;
    score.decays = growth.decays;
    score.modes.clear();
    for (const CandidateMode& c : growth.modes) score.modes.push_back(c.mode);
    const ScoreTest test = score_rotor_terms(records, grown.fit, grown.active, score);
    grown.chi_square = test.chi_square;
    grown.condition_number = test.condition_number;

    const Growth before = growth;
    const std::vector<std::string> terms = next_terms(test, growth, refused, options.score_threshold);
    std::string chosen;
    for (const std::string& term : terms) {
      const Growth trial = with_term(before, term, options);
      OutputErrorFit trial_fit = fit_output_error_rotor(records, trial.start, trial.active, eps, trial.delay);
      if (trial_fit.summary.status == Status::unusable) continue;
      if (!chosen.empty() && trial_fit.summary.chi_square >= fit.summary.chi_square) continue;
      fit = std::move(trial_fit);
      growth = trial;
      chosen = label(term, before);
    }
    // The trajectory must confirm the weak equations: likelihood ratio on the same scale.
    const double drop = chosen.empty() ? 0
                                       : values * (grown.fit.summary.chi_square - fit.summary.chi_square) /
                                             std::max(1.0, fit.summary.chi_square);
    if (drop >= options.score_threshold) {
      if (growth.start.modes.size() >= kMostSearched)
        std::erase_if(growth.modes, [](const auto& c) { return c.searched; });
      grown.added.push_back(chosen);
      refused.clear();
      continue;
    }
    growth = before;
    if (!terms.empty()) {
      refused.insert(refused.end(), terms.begin(), terms.end());
      fit = std::move(grown.fit);
      continue;
    }
    if (!test.candidates.empty() && test.candidates.front().score >= options.score_threshold && test.chi_square > 1.3) {
      grown.warnings.push_back(fmt::format(
          "the records hold a term {} (score {:.0f}, threshold {:.0f}) that the rotor model "
          "does not have",
          label(test.candidates.front().term, before), test.candidates.front().score, options.score_threshold));
    }
    return grown;
  }
}

}  // namespace whirl::identification::detail
