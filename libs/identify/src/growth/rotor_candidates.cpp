#include "growth/rotor_candidates.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rules/rules.hpp"

namespace whirl::identification::detail {

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
  for (const TermEntry* entry : term_catalogue()) {
    if (entry->force == nullptr) continue;
    const std::size_t parts =
        both ? entry->parameters.size() : std::min(entry->parameters.size(), entry->parts_of_one_axis);
    for (std::size_t part = 0; part < parts; ++part) {
      RotorTerm& term = terms.emplace_back(RotorTerm{entry, part});
      if (entry->reference != nullptr) term.reference = entry->reference(peak, main_frequency, records.front().t0);
    }
  }
  return terms;
}

double threshold_of(const TermEntry& term, double threshold) {
  const double tests = term.rare ? rules::kUsualTests + rules::kRareTests : rules::kUsualTests;
  return term.plain_threshold ? threshold : threshold + 2 * std::log(tests * term.chances);
}

double lead_over_usual(const std::vector<ScoreCandidate>& candidates, const std::vector<TermId>& refused,
                       double threshold) {
  double most = 0;
  for (const ScoreCandidate& c : candidates)
    if (c.term->in_model && !c.term->rare && std::ranges::find(refused, TermId{c.term, c.place}) == refused.end())
      most = std::max(most, c.score);
  return std::max(most / rules::kHalf, rules::kOfSearch * threshold);
}

std::vector<TermId> next_terms(const std::vector<ScoreCandidate>& candidates, const Growth& growth,
                               const std::vector<TermId>& refused, double threshold, bool rare, bool first,
                               double lead) {
  constexpr std::size_t kMost = 6;
  std::vector<TermId> terms;
  double best = 0;
  bool usual = false;                           // one of the usual terms has been met
  for (const ScoreCandidate& c : candidates) {  // by falling score
    const TermId id{c.term, c.place};
    if (!c.term->in_model || c.score < threshold_of(*c.term, threshold) || c.score < 0.1 * best ||
        terms.size() >= kMost || std::ranges::find(refused, id) != refused.end())
      continue;
    usual |= !c.term->rare;
    if (c.term->rare && !rare && !(c.score > lead) && (usual || !first)) continue;
    if (c.term->one_at_a_time) {
      if (c.score < rules::kOfSearch * threshold && growth.mode(c.place).searched) continue;
      if (std::ranges::any_of(terms, [](const TermId& t) { return t.entry->one_at_a_time; })) continue;
    }
    best = std::max(best, c.score);
    if (c.term->tries == nullptr) {
      terms.push_back(id);
      continue;
    }
    for (const int place : c.term->tries(growth)) terms.push_back({c.term, place});
  }
  return terms;
}

}  // namespace whirl::identification::detail
