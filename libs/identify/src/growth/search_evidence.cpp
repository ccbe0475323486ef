#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "growth/free_run_score.hpp"
#include "growth/rotor_search.hpp"
#include "rules/rules.hpp"
#include "terms/catalogue.hpp"

/// What the records say against a growing model.
namespace whirl::identification::detail {
namespace {

/// The candidates still open, and their places in the list.
template <typename Candidate, typename Mode>
std::vector<std::size_t> open_of(const std::vector<Candidate>& candidates, std::vector<Mode>& modes) {
  std::vector<std::size_t> places;
  modes.clear();
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (!candidates[k].open) continue;
    modes.push_back(candidates[k].mode);
    places.push_back(k);
  }
  return places;
}

}  // namespace

void begin_at(std::vector<RotorTerm>& terms, const ScoreCandidate& found, double instant) {
  for (RotorTerm& t : terms) {
    if (!t.is(*found.term)) continue;
    t.reference = instant;
    t.value = found.coefficient[static_cast<Eigen::Index>(t.part)];
  }
}

ScoreTest RotorSearch::test() {
  ScoreTest test = records_.front().quantity == Quantity::displacement
                       ? test_on_weak_rows()
                       : score_on_free_runs(records_, fit_, growth_, options_);
  grown_.chi_square = test.chi_square;
  grown_.condition_number = test.condition_number;
  grown_.test = test;
  return test;
}
ScoreTest RotorSearch::test_on_weak_rows() {
  score_.forces = growth_.forces;
  const std::vector<std::size_t> modes = open_of(growth_.modes, score_.modes);
  const std::vector<std::size_t> decays = open_of(growth_.decays, score_.decays);
  ScoreTest test = score_rotor_terms(records_, fit_, growth_.active, score_);
  if (rare_ && test.chi_square > rules::kModelError) find_instants(test);
  // The score test counts the open candidates; a term names a place of the whole list, which stays when others are
  // taken.
  for (ScoreCandidate& c : test.candidates) {
    if (c.term->frequency == nullptr) continue;
    const bool is_mode = c.term == &terms::mode();
    c.place = static_cast<int>((is_mode ? modes : decays)[static_cast<std::size_t>(c.place - 1)]) + 1;
    if (is_mode && growth_.mode(c.place).above) c.term = &terms::modes_above();
  }
  return test;
}
/// The instant of the highest score of a force that begins at one, among those given; its place counts them.
std::optional<ScoreCandidate> RotorSearch::best_instant(const TermEntry& entry, std::vector<double> instants) const {
  ScoreTestOptions alone;
  alone.half_width = score_.half_width;
  alone.delay = false;
  alone.runout_harmonics = 0;
  alone.forces = score_.forces;
  alone.instants = std::move(instants);
  std::ranges::copy_if(growth_.terms, std::back_inserter(alone.terms), [&](const RotorTerm& t) { return t.is(entry); });
  for (ScoreCandidate& c : score_rotor_terms(records_, fit_, growth_.active, alone).candidates)
    if (c.term == &entry) return std::move(c);  // by falling score
  return std::nullopt;
}

/// Forces that begin at one instant: the instant of the highest score, over the record and then ever nearer about it,
/// and with it the start of a fit, as candidates of the test.
void RotorSearch::find_instants(ScoreTest& test) {
  constexpr int kCoarse = 48, kFine = 9, kRounds = 3;
  if (!options_.terms) return;
  double first = INFINITY, last = -INFINITY;
  for (const RotorRecord& r : records_) {
    first = std::min(first, r.t0);
    last = std::max(last, r.t0 + r.dt * static_cast<double>(r.size()));
  }
  for (const TermEntry* entry : term_catalogue()) {
    if (entry->by_reference == nullptr) continue;
    double from = first, to = last;
    std::optional<ScoreCandidate> best;
    double instant = 0;
    for (int round = 0; round <= kRounds; ++round) {
      const int count = round == 0 ? kCoarse : kFine;
      std::vector<double> instants;
      for (int k = 1; k <= count; ++k) instants.push_back(from + (to - from) * k / (count + 1));
      std::optional<ScoreCandidate> found = best_instant(*entry, instants);
      if (found && !(best && found->score <= best->score)) {
        best = std::move(found);
        instant = instants[static_cast<std::size_t>(best->place - 1)];
      }
      if (!best) break;
      const double step = (to - from) / (count + 1);
      from = instant - step, to = instant + step;
    }
    if (!best) continue;
    best->place = 0;
    begin_at(growth_.terms, *best, instant);
    test.candidates.push_back(*std::move(best));
  }
  std::ranges::sort(test.candidates, std::ranges::greater(), &ScoreCandidate::score);
}

void RotorSearch::warn_of_missing(const ScoreTest& test) {
  if (test.candidates.empty() || test.chi_square <= rules::kModelError) return;
  const ScoreCandidate& first = test.candidates.front();
  const double threshold = threshold_of(*first.term, options_.score_threshold);
  if (first.score < threshold) return;
  grown_.warnings.push_back(
      fmt::format("the records hold a term {} (score {:.0f}, threshold {:.0f}) that the rotor model does not have",
                  label({first.term, first.place}, growth_), first.score, threshold));
}

}  // namespace whirl::identification::detail
