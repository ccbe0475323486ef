#include "growth/rotor_candidates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

namespace whirl::identification::detail {

namespace {
/// Place in the list of "mode 1", "decay 2", ...
std::size_t place_of(const std::string& term) { return std::stoul(term.substr(term.find(' ') + 1)) - 1; }
}  // namespace

std::vector<CandidateMode> hammer_modes(const RotorIdentifyOptions& options, double main_frequency) {
  std::vector<CandidateMode> modes;
  if (!options.modal) return modes;
  for (const Mode& m : options.modal->modes) {
    const double w = 2 * std::numbers::pi * m.frequency.value;
    if (std::abs(w / main_frequency - 1) > 0.03) modes.push_back({{w, std::max(m.damping.value, 1e-5), 0}, false});
  }
  return modes;
}

std::vector<CandidateMode> searched_modes(double top_speed, double main_frequency) {
  constexpr double kZeta = 0.02;
  std::vector<CandidateMode> modes;
  for (double w = 0.25 * top_speed; w < 1.4 * top_speed; w *= 1 + 2 * kZeta) {
    if (std::abs(w / main_frequency - 1) > 0.15) modes.push_back({{w, kZeta, 0}, true});
  }
  return modes;
}

std::vector<CandidateMode> modes_above(double highest) {
  constexpr double kZeta = 0.01;  // it acts through w alone
  std::vector<CandidateMode> modes;
  for (const double ratio : {2.0, 1.4, 1.6, 3.0, 6.0}) {
    modes.push_back({.mode = {ratio * highest, kZeta, 0}, .searched = false, .open = modes.empty(), .above = true});
  }
  return modes;
}

Start start_of(const OutputErrorFit& fit) {
  Start s{fit.model, fit.terms, {}, fit.delay};
  for (const OutputErrorRecord& r : fit.records) s.eps.push_back(r.eps);
  return s;
}

std::vector<RotorTerm> candidate_terms(const std::vector<RotorRecord>& records, double main_frequency) {
  double peak = 0;
  for (const RotorRecord& r : records) peak = std::max(peak, (r.z.array() - r.z.mean()).abs().maxCoeff());
  std::vector<RotorTerm> terms;
  const bool both = std::ranges::any_of(records, [](const RotorRecord& r) { return !r.one_axis(); });
  for (const RotorTermName& name : kRotorTermNames) {
    // One axis reads forward and backward alike.
    if (!both && name.kind >= RotorTermKind::twice_backward_re) continue;
    RotorTerm term{name.kind};
    if (name.kind == RotorTermKind::coulomb_friction) term.reference = 1e-3 * peak * main_frequency;
    if (name.kind == RotorTermKind::stiffness_drift || name.kind == RotorTermKind::damping_drift) {
      term.reference = records.front().t0;
    }
    terms.push_back(term);
  }
  return terms;
}

Growth with_term(Growth g, const std::string& term, const RotorIdentifyOptions& options) {
  const auto named = [&](const RotorTerm& t) { return name_of(t.kind).label == term; };
  if (term == kBow) {
    g.bow = true;
  } else if (std::ranges::any_of(g.terms, named)) {
    std::ranges::copy_if(g.terms, std::back_inserter(g.active.terms), named);
  } else if (term == "sensor gain") {
    g.active.sensor_gain = true;
  } else if (term == "sensor angle") {
    g.active.sensor_angle = true;
  } else if (term == "sampling skew") {
    g.active.sensor_skew = true;
  } else if (term == kFirstHighPass) {
    g.active.sensor_high_pass = true;
  } else if (term == kSecondHighPass) {
    g.active.sensor_high_pass_square = true;
  } else if (term == "probe curve") {
    g.active.sensor_cubic = true;
  } else if (term == "conj z") {
    g.active.conj_stiffness = true;
  } else if (term == "conj z'") {
    g.active.conj_damping = true;
  } else if (term.starts_with("runout")) {
    g.active.runout_harmonics = term.back() - '0';
  } else if (term == "delay") {
    g.active.delay = true;
  } else {
    const std::size_t k = place_of(term);
    if (is_above(term, g)) {
      g.active.given_mode = static_cast<int>(g.start.modes.size());
      g.start.modes.push_back(g.modes[k].mode);
      for (CandidateMode& c : g.modes) c.open = c.open && !c.above;
      return g;
    }
    if (term.starts_with("mode")) {
      const ForcedMode mode = g.modes[k].mode;
      g.start.modes.push_back(mode);
      for (CandidateMode& c : g.modes) c.open = c.open && (c.above || std::abs(c.mode.omega / mode.omega - 1) >= 0.1);
    } else {
      CandidateDecay& decay = g.decays[k];
      g.active.decays.push_back(decay.mode);
      decay.open = false;
    }
    g.active.poles = options.refine_poles;
  }
  return g;
}

std::optional<Growth> without_term(Growth g, const std::string& term) {
  if (std::erase_if(g.active.terms, [&](const RotorTerm& t) { return name_of(t.kind).label == term; }) > 0) return g;
  if (term == "sensor gain") {
    g.active.sensor_gain = false;
    g.active.sensor.gain = 0;
  } else if (term == "sensor angle") {
    g.active.sensor_angle = false;
    g.active.sensor.angle = 0;
  } else if (term == "sampling skew") {
    g.active.sensor_skew = false;
    g.active.sensor.skew = 0;
  } else if (term == kSecondHighPass) {
    g.active.sensor_high_pass_square = false;
    g.active.sensor.high_pass_square = 0;
  } else if (term == kFirstHighPass && !g.active.sensor_high_pass_square) {
    g.active.sensor_high_pass = false;
    g.active.sensor.high_pass = 0;
  } else if (term == "probe curve") {
    g.active.sensor_cubic = false;
    g.active.sensor.cubic = 0;
  } else if (term == "conj z") {
    g.active.conj_stiffness = false;
    g.start.k1_conj = 0;
  } else if (term == "conj z'") {
    g.active.conj_damping = false;
    g.start.c_conj = 0;
  } else if (term == "delay") {
    g.active.delay = false;
    g.delay = 0;
  } else if (term == kBow) {
    g.bow = false;
    g.forces.clear();
  } else if (term.starts_with("runout") && !g.bow) {
    g.active.runout_harmonics = 0;
  } else if (is_above(term, g) && g.active.given_mode + 1 == static_cast<int>(g.start.modes.size())) {
    g.start.modes.pop_back();
    g.active.given_mode = -1;
    std::ranges::find_if(g.modes, &CandidateMode::above)->open = true;
  } else {
    return std::nullopt;
  }
  return g;
}

std::string label(const std::string& term, const Growth& g) {
  if (!term.starts_with("mode ") && !term.starts_with("decay ")) return term;
  if (is_above(term, g)) return kAbove;
  const std::size_t space = term.find(' '), k = place_of(term);
  const double w = term.starts_with("mode") ? g.modes[k].mode.omega : g.decays[k].mode.omega;
  return fmt::format("{} {:.4g} Hz", term.substr(0, space), w / (2 * std::numbers::pi));
}

bool is_special(const std::string& term) {
  return term.starts_with("conj") || term.starts_with("mode") || term.starts_with("decay") ||
         term.starts_with("runout") || term == "delay" || term == name_of(RotorTermKind::twice_forward_re).label;
}
bool is_above(const std::string& term, const Growth& g) {
  return term.starts_with("mode ") && g.modes[place_of(term)].above;
}
double threshold_of(const std::string& term, const Growth& g, double threshold) {
  constexpr double kMoreChances = 16;  // forces, sensor axes, modes above the speeds
  return is_special(term) && !is_above(term, g) ? threshold : threshold + 2 * std::log(kMoreChances);
}

std::vector<std::string> next_terms(const ScoreTest& test, const Growth& growth,
                                    const std::vector<std::string>& refused, double threshold) {
  constexpr std::size_t kMost = 6;
  std::vector<std::string> terms;
  double best = 0;
  for (const ScoreCandidate& c : test.candidates) {
    if (!c.in_model || c.score < threshold_of(c.term, growth, threshold) || c.score < 0.1 * best ||
        terms.size() >= kMost || std::find(refused.begin(), refused.end(), c.term) != refused.end())
      continue;
    if (c.term.starts_with("mode ")) {
      if (c.score < 3 * threshold && growth.modes[place_of(c.term)].searched) continue;
      // Modes next to each other are one candidate.
      if (std::any_of(terms.begin(), terms.end(), [](const auto& t) { return t.starts_with("mode "); })) continue;
    }
    best = std::max(best, c.score);
    if (!is_above(c.term, growth)) {
      terms.push_back(c.term);
      continue;
    }
    for (std::size_t k = 0; k < growth.modes.size(); ++k) {
      if (growth.modes[k].above) terms.push_back(fmt::format("mode {}", k + 1));
    }
  }
  return terms;
}

}  // namespace whirl::identification::detail
