#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "growth/rotor_search.hpp"
#include "growth/term_sizes.hpp"
#include "rules/rules.hpp"
#include "terms/catalogue.hpp"
#include "whirl/core/parallel.hpp"

/// One step of the search after the other.
namespace whirl::identification::detail {
namespace {

constexpr int kMostKinds = 6;             // kinds of forces beyond RotorModel that the motion causes
constexpr std::size_t kMostForces = 10;   // and all forces that a fit takes
constexpr double kNear = 40;              // likelihood ratio: tried again with the final model
constexpr std::size_t kLikely = 2;        // candidates of the highest scores: fitted to the end
constexpr std::size_t kMostSearched = 4;  // modes taken up before the search of unlisted ones ends

/// Of a force that begins at one.
double instant_of(const Start& found, const TermEntry& entry) {
  return std::ranges::find_if(found.terms, [&](const RotorTerm& t) { return t.is(entry); })->reference;
}

}  // namespace

bool too_many(const Growth& growth) {
  const std::vector<RotorTerm>& terms = growth.active.terms;
  int kinds = 0;
  for (std::size_t i = 0; i < terms.size(); ++i)
    kinds += !terms[i].entry->external && std::none_of(terms.begin(), terms.begin() + static_cast<std::ptrdiff_t>(i),
                                                       [&](const RotorTerm& t) { return t.is(*terms[i].entry); });
  return terms.size() > kMostForces || kinds > kMostKinds;
}

double price(const OutputErrorFit& fit, const Growth& growth) {
  // Shares of a plain step, measured: a force, an angle that moves, one of the five responses of a mode that moves.
  constexpr double kTerm = 0.25, kAngle = 1.5, kMode = 0.4;
  constexpr int kAround = 2;  // simulations before the first step and after the last
  const OutputErrorOptions& a = growth.active;
  const bool turning = a.clock.delay || a.clock.drift || a.clock.profile_degree > 0;
  const double force = fit.substeps * (1 + kTerm * static_cast<double>(a.terms.size()) + (turning ? kAngle : 0));
  const double modes = kMode * static_cast<double>(growth.start.modes.size()) * (a.modes.poles ? 5 : turning ? 1 : 0);
  return (fit.iterations + kAround) * (force + modes);
}

/// One more term; false when none is left that the evidence asks for.
bool RotorSearch::step() {
  settle();
  const ScoreTest score = test();
  if (gives_up()) {
    warn_of_missing(score);
    return false;
  }
  const std::vector<TermId> terms =
      next_terms(score.candidates, growth_, refused_, options_.score_threshold, rare_, taken_.empty(), lead(score));
  Trials trials = try_each(terms, score);
  // The trajectory must confirm the weak equations.
  if (trials.best) {
    const TermEntry& term = *trials.tried[trials.chosen].term.entry;
    if (plausible_gain(fit_, *trials.best) >= threshold_of(term, options_.score_threshold) &&
        explains_enough(*trials.best)) {
      take_up(std::move(trials));
      return true;
    }
  }
  refused_.insert(refused_.end(), terms.begin(), terms.end());
  if (!terms.empty()) return true;
  warn_of_missing(score);
  return false;
}

/// Score from which on a rare term leads. Several records may differ by springs of their own, which come first.
double RotorSearch::lead(const ScoreTest& score) const {
  if (records_.size() > 1) return INFINITY;
  return lead_over_usual(score.candidates, refused_, options_.score_threshold);
}

/// A fit with each term; those of the highest scores and those that begin at one instant to the end.
RotorSearch::Trials RotorSearch::try_each(const std::vector<TermId>& terms, const ScoreTest& score) {
  Trials trials;
  std::vector<std::pair<std::size_t, OutputErrorFit>> slow;  // that ran out of steps; a fit holds its motions
  const auto leads = [&, least = lead(score)](const TermEntry* entry) {
    return std::ranges::any_of(score.candidates,
                               [&](const ScoreCandidate& c) { return c.term == entry && c.score > least; });
  };
  std::vector<std::pair<TermId, Growth>> larger;
  for (const TermId& term : terms) {
    larger.emplace_back(term, with_term(growth_, term, options_.refine_poles));
    if (too_many(larger.back().second)) larger.pop_back();
  }
  std::vector<Trial> runs(larger.size());
  const auto run = [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    runs[at] = trial_of(larger[at].second, larger[at].first, score);
  };
  const auto weigh = [&](int i) {
    auto& [term, growth] = larger[static_cast<std::size_t>(i)];
    auto [trial, before] = std::move(runs[static_cast<std::size_t>(i)]);
    count(trial, growth, before);
    if (trial.summary.status == Status::unusable) return;
    // A rare term that leaves something is no better than usual ones that together leave nothing, unless it leads.
    if (term.entry->rare && !rare_ && !(trial.summary.chi_square < rules::kModelError) && !leads(term.entry)) return;
    trials.tried.push_back({term, std::move(growth)});
    const std::size_t k = trials.tried.size() - 1;
    if (k < kLikely && ran_out(trial, trials.tried[k].with)) slow.emplace_back(k, trial);
    take(trials, k, std::move(trial));
  };
  parallel_trials(
      static_cast<int>(larger.size()), most_, [&] { return spent() || unwanted_.stop_requested(); }, run, weigh);
  try_at_one_instant(trials);
  for (auto& [k, trial] : slow) {
    if (spent()) break;
    // The best one goes on for what would be told apart, another one to be better than that.
    const double least = trials.best->summary.chi_square, apart = rules::kToldApart * std::max(1.0, least) / values_;
    const Growth& with = trials.tried[k].with;
    OutputErrorFit further = fit_to_the_end(with, std::move(trial), least - (k == trials.chosen ? apart : 0));
    count(further, with);
    take(trials, k, std::move(further));
  }
  return trials;
}

/// A change has one instant, whatever changed: where a change leads, each other one is fitted at its instant, too. The
/// weak equations of a noisy record put each where the noise looks most like it.
void RotorSearch::try_at_one_instant(Trials& trials) {
  if (!trials.best) return;
  const Tried& leads = trials.tried[trials.chosen];
  const TermEntry* leading = leads.term.entry;
  if (leading->by_reference == nullptr) return;
  const double instant = instant_of(leads.found, *leading);
  struct Moved {
    std::size_t of;
    Growth with;
    ScoreCandidate there;
    Trial trial = {};
  };
  std::vector<Moved> moved;
  for (std::size_t k = 0; k < trials.tried.size(); ++k) {
    const Tried& other = trials.tried[k];
    const TermEntry& entry = *other.term.entry;
    if (entry.by_reference == nullptr || &entry == leading) continue;
    const double half_period = std::numbers::pi / std::sqrt(other.found.model.k1);
    if (std::abs(instant_of(other.found, entry) - instant) < half_period) continue;
    const std::optional<ScoreCandidate> there = best_instant(entry, {instant});
    if (!there) continue;
    moved.push_back({k, other.with, *there});
    begin_at(moved.back().with.active.terms, *there, instant);
  }
  const auto run = [&](int i) {
    Moved& m = moved[static_cast<std::size_t>(i)];
    m.trial = fit_about_instant(m.with, m.there);
  };
  const auto weigh = [&](int i) {
    auto& [k, with, there, fitted] = moved[static_cast<std::size_t>(i)];
    Trial trial = std::move(fitted);  // its motions go with it
    count(trial.fit, with, trial.before);
    if (trial.fit.summary.status != Status::unusable && trial.fit.summary.chi_square < trials.tried[k].chi_square)
      take(trials, k, std::move(trial.fit));
  };
  parallel_trials(
      static_cast<int>(moved.size()), most_, [&] { return spent(); }, run, weigh);
}

void RotorSearch::take(Trials& trials, std::size_t k, OutputErrorFit&& trial) const {
  Tried& tried = trials.tried[k];
  tried.chi_square = trial.summary.chi_square;
  tried.surprise = surprise(trial);
  tried.found = start_of(trial);
  if (trials.best && k != trials.chosen && plausible_gain(trial, *trials.best) >= 0) return;
  trials.best = std::move(trial);
  trials.chosen = k;
}

/// The best of them is in the model from here on; those that did nearly as well are tried again with the final one.
void RotorSearch::take_up(Trials&& trials) {
  Tried& chosen = trials.tried[trials.chosen];
  const TermId term = chosen.term;
  for (Tried& t : trials.tried) {
    const double least = trials.best->summary.chi_square, far = kNear + chosen.surprise - t.surprise;
    if (label(t.term, growth_) != label(term, growth_) && values_ * (t.chi_square - least) < far * least)
      near_.push_back({term, t.term, std::move(t.found)});
  }
  taken_.push_back({term, label(term, growth_), start_of(fit_)});
  grown_.added.push_back(taken_.back().label);
  grown_.mode_found |= term.entry == &terms::mode();
  if (term.entry->one_at_a_time && growth_.mode(term.place).searched) {
    grown_.warnings.push_back(
        fmt::format("{} is found in these records alone: k1, c and e are those of the first mode, and those of the "
                    "disk only where it does not tilt and its supports stay at rest; to decide: a hammer test "
                    "(--modes)",
                    taken_.back().label));
  }
  fit_ = std::move(*trials.best);
  growth_ = std::move(chosen.with);
  if (growth_.start.modes.size() >= kMostSearched)
    for (CandidateMode& c : growth_.modes) c.open = c.open && !c.searched;
  refused_.clear();
  refine_grid();
  if (term.entry == &terms::runout() && !growth_.bow) try_bow();
}

/// Runout of the probe's track or a bow of the shaft: they differ by the damping force i c omega b alone.
void RotorSearch::try_bow() {
  settle();
  const Growth bowed = with_term(growth_, {&terms::bow()}, options_.refine_poles);
  OutputErrorFit trial = fit(bowed);
  if (trial.summary.status == Status::unusable || gain(fit_, trial) < rules::kToldApart) return;
  const Start before = start_of(fit_);
  fit_ = std::move(trial);
  growth_ = bowed;
  taken_.push_back({{&terms::bow()}, std::string(terms::bow().label), before});
  grown_.added.push_back(taken_.back().label);
}

/// Where much stays unexplained, any term of many takes up a little of it, at one long fit each: what the model lacks
/// is then something else.
bool RotorSearch::explains_enough(const OutputErrorFit& larger) const {
  const double before = fit_.summary.chi_square, after = larger.summary.chi_square;
  return after < rules::kAnotherModel || before - after >= rules::kExplainsLeast * (before - 1);
}

/// Adds what a trial fit cost, `before` it included.
void RotorSearch::count(const OutputErrorFit& trial, const Growth& growth, double before) {
  tried_ += trial.iterations;
  tried_in_all_ += price(trial, growth) + before;
}
/// What a search may cost is used up: about 3 ms a step for 12 s at 1 kHz.
bool RotorSearch::spent() const {
  constexpr double kMost = 300, kMostOfModes = 600;
  return misfit() > rules::kModelError && tried_in_all_ - at_gain_ > (modes_ ? kMostOfModes : kMost);
}

/// Something stays unexplained, and no term of many trial fits took half of it: it is none of the terms known here.
/// Where each takes half but there is no end of them, they stand in for something else.
bool RotorSearch::gives_up() {
  constexpr double kPatience = 150;   // steps of the trial fits
  constexpr double kOneOfMany = 0.8;  // of the rest that a term leaves
  const double rest = misfit();
  const bool halved = rest - 1 <= 0.5 * (halved_ - 1);
  // A machine with many usual parts takes many steps. (Several records may differ by springs of their own, which are
  // tried before much else is; rare terms and modes of any frequency can follow what is none of them.)
  if ((halved || rest - 1 <= kOneOfMany * (last_ - 1)) && records_.size() == 1 && !rare_ && !modes_)
    at_gain_ = tried_in_all_;
  last_ = rest;
  if (halved) {
    halved_ = rest;
    tried_ = 0;
  }
  return rest > rules::kModelError && (tried_ > kPatience || spent());
}

}  // namespace whirl::identification::detail
