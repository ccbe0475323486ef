#include "growth/rotor_growth.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "growth/free_run_score.hpp"
#include "growth/rotor_candidates.hpp"
#include "terms/catalogue.hpp"
#include "whirl/identify/score_test.hpp"

namespace whirl::identification::detail {
namespace {

using Complex = std::complex<double>;

// Likelihood ratios: tried again with the final model; not told apart (three sigma). Score of a hint (3.3 sigma).
constexpr double kNear = 40, kTie = 9, kHint = 10.8;
constexpr double kMuch = 4;               // chi-square of a model that lacks something large
constexpr double kMissing = 1.3;          // and of one that lacks anything
constexpr std::ptrdiff_t kMostTerms = 6;  // forces beyond RotorModel that the motion causes
constexpr std::size_t kMostForces = 10;   // and all that a fit takes
constexpr int kMostSubsteps = 16;
constexpr std::size_t kLikely = 2;        // candidates of the highest scores: fitted to the end
constexpr std::size_t kMostSearched = 4;  // modes taken up before the search of unlisted ones ends

/// Acceleration of the motion about the bow by the damping of the bow's own turning: -i c omega b e^{i beta}.
KnownForces bow_forces(const OutputErrorFit& fit) {
  KnownForces forces;
  for (const OutputErrorRecord& r : fit.records) {
    Eigen::VectorXcd force(r.angle.beta.size());
    for (Eigen::Index i = 0; i < force.size(); ++i) {
      force[i] =
          Complex(0, -(fit.model.c + r.c_change) * r.angle.omega[i]) * r.runout[0] * std::polar(1.0, r.angle.beta[i]);
    }
    forces.push_back(std::move(force));
  }
  return forces;
}

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

/// Whether the model has more forces beyond RotorModel than one record can carry.
bool too_many(const Growth& growth) {
  const std::vector<RotorTerm>& terms = growth.active.terms;
  return terms.size() > kMostForces ||
         std::ranges::count_if(terms, [](const RotorTerm& t) { return !t.entry->external; }) > kMostTerms;
}

/// The search of one model.
class Grower {
 public:
  Grower(const std::vector<RotorRecord>& records, Growth start, std::vector<Complex> eps,
         const RotorIdentifyOptions& options)
      : records_(records), options_(options), growth_(std::move(start)), eps_(std::move(eps)) {
    for (const RotorRecord& r : records) values_ += r.readings();
    score_.half_width = options.half_width;
    score_.runout_harmonics = options.runout_harmonics;
    score_.delay = options.delay;
    score_.terms = growth_.terms;
    score_.sensor = options.terms;
    fit_ = fit(growth_);
    if (!growth_.active.terms.empty() && ran_out(fit_, growth_)) {
      const double half = 0.5 * fit_.summary.chi_square;
      fit_ = fit_to_the_end(growth_, std::move(fit_), half);
    }
    for (const RotorTerm& term : growth_.active.terms) {  // given from the start
      taken_.push_back({{term.entry}, std::string(term.entry->label), start_of(fit_)});
      grown_.added.push_back(taken_.back().label);
    }
    halved_ = fit_.summary.chi_square;
    keep_grid();
  }

  GrownRotor run() {
    while (usable() && step()) {
    }
    if (usable()) {
      prune();
      find_others();
      settle();
      const bool both = !std::ranges::all_of(records_, &RotorRecord::one_axis);
      grown_.absent =
          absent_terms(records_, fit_, growth_.active, growth_.terms, options_.terms && both, growth_.forces);
    }
    grown_.fit = std::move(fit_);
    grown_.active = growth_.active;
    grown_.bow = growth_.bow;
    return std::move(grown_);
  }

 private:
  bool usable() const { return fit_.summary.status != Status::unusable; }
  OutputErrorFit fit(const Growth& g) const { return fit(g, eps_); }
  OutputErrorFit fit(const Growth& g, const std::vector<Complex>& start_eps) const {
    OutputErrorFit found = fit_with_forces(records_, g.start, g.active, start_eps, g.delay, g.forces);
    // The force of a bow follows from what is found: c and the bow change it by little.
    for (int pass = 0; g.bow && pass < 2 && found.summary.status != Status::unusable; ++pass) {
      OutputErrorOptions active = g.active;
      active.decays = found.decays;
      active.terms = found.terms;
      active.sensor = found.sensor;
      active.start_drift = found.clock_drift;
      const std::vector<Complex> eps = start_of(found).eps;
      found = fit_with_forces(records_, found.model, active, eps, found.delay, bow_forces(found));
    }
    return found;
  }
  static bool ran_out(const OutputErrorFit& fit, const Growth& g) {
    return fit.summary.status != Status::unusable && fit.iterations >= g.active.max_iterations;
  }
  /// A fit that ran out of steps goes on from where it stands, as long as it would come below the chi-square `target`
  /// at the pace of its last steps: the better term must not lose by them, and a hopeless one costs no second.
  OutputErrorFit fit_to_the_end(const Growth& g, OutputErrorFit found, double target) const {
    for (const auto& [steps, then] : {std::pair{20, 80}, std::pair{80, 0}}) {
      const Start at = start_of(found);
      Growth on = g;
      on.start = at.model;
      on.delay = at.delay;
      on.active.terms = at.terms;
      on.active.sensor = found.sensor;
      on.active.decays = found.decays;
      on.active.start_drift = found.clock_drift;
      on.active.max_iterations = steps;
      OutputErrorFit further = fit(on, at.eps);
      const double before = found.summary.chi_square, after = further.summary.chi_square;
      if (further.summary.status == Status::unusable || !(after < before)) break;
      const bool converged = further.iterations < steps;
      found = std::move(further);
      if (converged || !(after * std::pow(after / before, double(then) / steps) < target)) break;
    }
    return found;
  }
  /// The better of two fits, from where the growing model stands and from `before`: without a large term the other
  /// values are far from their place.
  OutputErrorFit fit_from_either(const Growth& g, const Start& before) const {
    OutputErrorFit here = fit(g);
    Growth then = g;
    then.start = before.model;
    then.start.modes = g.start.modes;
    then.delay = g.active.delay ? before.delay : g.delay;
    for (RotorTerm& t : then.active.terms) {
      const auto at = std::find_if(before.terms.begin(), before.terms.end(),
                                   [&](const RotorTerm& b) { return b.is(*t.entry) && b.part == t.part; });
      if (at == before.terms.end()) continue;
      t.value = at->value;
      if (t.entry->by_reference != nullptr) t.reference = at->reference;
    }
    OutputErrorFit there = fit(then, before.eps);
    const auto usable = [](const OutputErrorFit& f) { return f.summary.status != Status::unusable; };
    if (!usable(there)) return here;
    return usable(here) && here.summary.chi_square <= there.summary.chi_square ? here : there;
  }
  /// Likelihood ratio of two fits, in the metric of the residual that the larger one leaves.
  double gain(const OutputErrorFit& smaller, const OutputErrorFit& larger) const {
    return values_ * (smaller.summary.chi_square - larger.summary.chi_square) /
           std::max(1.0, larger.summary.chi_square);
  }
  /// The next fit starts where this one ended.
  void settle() {
    growth_.start = fit_.model;
    growth_.active.decays = fit_.decays;
    growth_.active.terms = fit_.terms;
    growth_.active.sensor = fit_.sensor;
    for (std::size_t r = 0; r < eps_.size(); ++r) {
      if (!growth_.active.record_k1.empty()) growth_.active.record_k1[r] = fit_.records[r].k1_change;
      if (!growth_.active.record_c.empty()) growth_.active.record_c[r] = fit_.records[r].c_change;
    }
    growth_.delay = fit_.delay;
    growth_.active.start_drift = fit_.clock_drift;
    if (growth_.bow) growth_.forces = bow_forces(fit_);
    for (std::size_t r = 0; r < eps_.size(); ++r) eps_[r] = fit_.records[r].eps;
  }
  /// The search compares fits of one grid.
  void keep_grid() {
    growth_.active.substeps = fit_.substeps;
    grid_for_ = fit_.summary.chi_square;
  }
  /// A model that leaves less asks for a finer grid.
  void refine_grid() {
    constexpr double kLess = 0.5;
    if (fit_.substeps == kMostSubsteps || !(fit_.summary.chi_square < kLess * grid_for_)) return;
    settle();
    growth_.active.substeps = 0;
    OutputErrorFit finer = fit(growth_);
    if (finer.summary.status != Status::unusable) fit_ = std::move(finer);
    keep_grid();
  }
  ScoreTest test() {
    ScoreTest test = records_.front().quantity == Quantity::displacement
                         ? test_on_weak_rows()
                         : score_on_free_runs(records_, fit_, growth_, options_);
    grown_.chi_square = test.chi_square;
    grown_.condition_number = test.condition_number;
    grown_.test = test;
    return test;
  }
  ScoreTest test_on_weak_rows() {
    score_.forces = growth_.forces;
    const std::vector<std::size_t> modes = open_of(growth_.modes, score_.modes);
    const std::vector<std::size_t> decays = open_of(growth_.decays, score_.decays);
    ScoreTest test = score_rotor_terms(records_, fit_, growth_.active, score_);
    if (test.chi_square > kMissing) find_instants(test);
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
  void find_instants(ScoreTest& test);
  bool step();
  void try_bow();
  bool gives_up();
  bool beyond_doubt(const Growth& less) const;
  bool explains_enough(const OutputErrorFit& larger) const;
  void prune();
  void find_others();
  void find_second_kind();
  void warn_of_missing(const ScoreTest& test);

  const std::vector<RotorRecord>& records_;
  const RotorIdentifyOptions& options_;
  Growth growth_;
  std::vector<Complex> eps_;
  ScoreTestOptions score_;
  double values_ = 0;    // real readings
  double grid_for_ = 0;  // chi-square of the fit that chose the grid
  int tried_ = 0;        // steps of trial fits since the rest was halved
  double halved_ = 0;    // chi-square that began them
  OutputErrorFit fit_;
  GrownRotor grown_;
  struct Taken {
    TermId term;
    std::string label;
    Start before;  // the fit without it
  };
  struct Near {
    TermId taken, other;  // term taken, term that did nearly as well
    Start with;           // the fit with that one
  };
  std::vector<Taken> taken_;
  std::vector<Near> near_;
  std::vector<TermId> refused_;
};

/// Forces that begin at one instant: the instant of the highest score, over the record and then ever nearer about it,
/// and with it the start of a fit, as candidates of the test.
void Grower::find_instants(ScoreTest& test) {
  constexpr int kCoarse = 48, kFine = 9, kRounds = 3;
  if (!options_.terms) return;
  double first = INFINITY, last = -INFINITY;
  for (const RotorRecord& r : records_) {
    first = std::min(first, r.t0);
    last = std::max(last, r.t0 + r.dt * static_cast<double>(r.size()));
  }
  for (const TermEntry* entry : term_catalogue()) {
    if (entry->by_reference == nullptr) continue;
    ScoreTestOptions alone;
    alone.half_width = score_.half_width;
    alone.delay = false;
    alone.runout_harmonics = 0;
    alone.forces = score_.forces;
    std::ranges::copy_if(growth_.terms, std::back_inserter(alone.terms),
                         [&](const RotorTerm& t) { return t.is(*entry); });
    double from = first, to = last;
    std::optional<ScoreCandidate> best;
    double instant = 0;
    for (int round = 0; round <= kRounds; ++round) {
      const int count = round == 0 ? kCoarse : kFine;
      alone.instants.clear();
      for (int k = 1; k <= count; ++k) alone.instants.push_back(from + (to - from) * k / (count + 1));
      for (const ScoreCandidate& c : score_rotor_terms(records_, fit_, growth_.active, alone).candidates) {
        if (c.term != entry || (best && c.score <= best->score)) continue;
        best = c;
        instant = alone.instants[static_cast<std::size_t>(c.place - 1)];
      }
      if (!best) break;
      const double step = (to - from) / (count + 1);
      from = instant - step, to = instant + step;
    }
    if (!best) continue;
    best->place = 0;
    for (RotorTerm& t : growth_.terms) {
      if (!t.is(*entry)) continue;
      t.reference = instant;
      t.value = best->coefficient[static_cast<Eigen::Index>(t.part)];
    }
    test.candidates.push_back(*std::move(best));
  }
  std::ranges::sort(test.candidates, std::ranges::greater(), &ScoreCandidate::score);
}

/// One more term; false when none is left that the evidence asks for.
bool Grower::step() {
  settle();
  const ScoreTest score = test();
  if (gives_up()) {
    warn_of_missing(score);
    return false;
  }
  const std::vector<TermId> terms = next_terms(score.candidates, growth_, refused_, options_.score_threshold);
  struct Tried {
    TermId term;
    Growth with;
    double chi_square;
    Start found;
  };
  std::vector<Tried> tried;
  std::optional<OutputErrorFit> best;
  std::size_t chosen = 0;
  std::vector<std::pair<std::size_t, OutputErrorFit>> slow;  // that ran out of steps; a fit holds its motions
  const auto take = [&](std::size_t k, OutputErrorFit&& trial) {
    tried[k].chi_square = trial.summary.chi_square;
    tried[k].found = start_of(trial);
    if (best && k != chosen && trial.summary.chi_square >= best->summary.chi_square) return;
    best = std::move(trial);
    chosen = k;
  };
  for (const TermId& term : terms) {
    Growth with = with_term(growth_, term, options_.refine_poles);
    if (too_many(with)) continue;
    OutputErrorFit trial = fit(with);
    tried_ += trial.iterations;
    if (trial.summary.status == Status::unusable) continue;
    tried.push_back({term, std::move(with), 0, {}});
    const std::size_t k = tried.size() - 1;
    if (k < kLikely && ran_out(trial, tried[k].with)) slow.emplace_back(k, trial);
    take(k, std::move(trial));
  }
  for (auto& [k, trial] : slow) {
    // The best one goes on for what would be told apart, another one to be better than that.
    const double least = best->summary.chi_square, apart = kTie * std::max(1.0, least) / values_;
    OutputErrorFit further = fit_to_the_end(tried[k].with, std::move(trial), least - (k == chosen ? apart : 0));
    tried_ += further.iterations;
    take(k, std::move(further));
  }
  // The trajectory must confirm the weak equations.
  const TermId term = best ? tried[chosen].term : TermId{};
  if (best && gain(fit_, *best) >= threshold_of(*term.entry, options_.score_threshold) && explains_enough(*best)) {
    for (Tried& t : tried) {
      if (label(t.term, growth_) != label(term, growth_) &&
          values_ * (t.chi_square - best->summary.chi_square) < kNear * best->summary.chi_square)
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
    fit_ = std::move(*best);
    growth_ = std::move(tried[chosen].with);
    if (growth_.start.modes.size() >= kMostSearched)
      for (CandidateMode& c : growth_.modes) c.open = c.open && !c.searched;
    refused_.clear();
    refine_grid();
    if (term.entry == &terms::runout() && !growth_.bow) try_bow();
    return true;
  }
  refused_.insert(refused_.end(), terms.begin(), terms.end());
  if (!terms.empty()) return true;
  warn_of_missing(score);
  return false;
}

/// Runout of the probe's track or a bow of the shaft: they differ by the damping force i c omega b alone.
void Grower::try_bow() {
  settle();
  const Growth bowed = with_term(growth_, {&terms::bow()}, options_.refine_poles);
  OutputErrorFit trial = fit(bowed);
  if (trial.summary.status == Status::unusable || gain(fit_, trial) < kTie) return;
  const Start before = start_of(fit_);
  fit_ = std::move(trial);
  growth_ = bowed;
  taken_.push_back({{&terms::bow()}, std::string(terms::bow().label), before});
  grown_.added.push_back(taken_.back().label);
}

/// Where much stays unexplained, any term of many takes up a little of it, at one long fit each: what the model lacks
/// is then something else.
bool Grower::explains_enough(const OutputErrorFit& larger) const {
  constexpr double kLeast = 0.01;
  const double before = fit_.summary.chi_square, after = larger.summary.chi_square;
  return after < kMuch || before - after >= kLeast * (before - 1);
}

/// Something stays unexplained, and no term of many trial fits took half of it: it is none of the terms known here.
bool Grower::gives_up() {
  constexpr int kPatience = 150;  // steps of the trial fits
  const double rest = fit_.summary.chi_square;
  if (rest - 1 <= 0.5 * (halved_ - 1)) {
    halved_ = rest;
    tried_ = 0;
  }
  return rest > kMissing && tried_ > kPatience;
}

/// The parameters that `less` lacks are so many deviations from 0 that no fit without them needs to be tried. A term
/// that another one replaces has wide deviations beside it.
bool Grower::beyond_doubt(const Growth& less) const {
  constexpr double kFar = 25;  // times the threshold
  const std::vector<Parameter> kept = parameter_list(records_, less.active, less.start.modes.size());
  std::vector<Eigen::Index> dropped;
  for (std::size_t j = 0; j < fit_.names.size(); ++j) {
    if (std::ranges::none_of(kept, [&](const Parameter& q) { return q.name == fit_.names[j]; }))
      dropped.push_back(static_cast<Eigen::Index>(j));
  }
  if (dropped.empty()) return false;
  const Eigen::VectorXd value = fit_.values(dropped);
  const Eigen::MatrixXd spread = std::max(1.0, fit_.summary.chi_square) * fit_.covariance(dropped, dropped);
  return value.dot(spread.ldlt().solve(value)) > kFar * options_.score_threshold;
}

/// Takes out terms that stood in for one that came later.
void Grower::prune() {
  if (taken_.size() < 2) return;
  bool changed = false;
  for (auto at = taken_.begin(); at != taken_.end();) {
    const std::optional<Growth> less = without_term(growth_, at->term);
    if (less && beyond_doubt(*less)) {
      ++at;
      continue;
    }
    OutputErrorFit without;
    if (less) without = fit_from_either(*less, at->before);
    if (!less || without.summary.status == Status::unusable ||
        gain(without, fit_) >= threshold_of(*at->term.entry, options_.score_threshold)) {
      ++at;
      continue;
    }
    growth_ = *less;
    fit_ = std::move(without);
    settle();
    std::erase(grown_.added, at->label);
    at = taken_.erase(at);
    changed = true;
  }
  if (changed) test();
}

/// Models that the records cannot tell from this one: with another term in the place of one taken up, or with a term
/// whose evidence is strong but not enough.
void Grower::find_others() {
  const auto is_taken = [&](const TermId& term) {
    return std::any_of(taken_.begin(), taken_.end(), [&](const Taken& t) { return t.term == term; });
  };
  for (const auto& [taken, other, with] : near_) {
    if (!is_taken(taken) || is_taken(other)) continue;
    const std::optional<Growth> less = without_term(growth_, taken);
    if (!less) continue;
    OutputErrorFit replaced = fit_from_either(with_term(*less, other, options_.refine_poles), with);
    if (replaced.summary.status != Status::unusable && gain(replaced, fit_) < kTie)
      grown_.others.push_back({label(taken, growth_), label(other, growth_),
                               std::min(taken.entry->decider, other.entry->decider), std::move(replaced)});
  }
  find_second_kind();
  if (fit_.summary.chi_square > kMuch) return;  // every term shows a sign of what is missing
  for (const ScoreCandidate& c : grown_.test.candidates) {
    if (!c.term->in_model || !c.term->hinted || c.score < kHint) continue;
    const Growth with = with_term(growth_, {c.term, c.place}, options_.refine_poles);
    if (too_many(with)) continue;
    OutputErrorFit more = fit(with);
    if (more.summary.status != Status::unusable && gain(fit_, more) >= kTie)
      grown_.others.push_back({"", std::string(c.term->label), c.term->decider, std::move(more)});
  }
}

/// An error of the probes that needs one of the model in its place.
void Grower::find_second_kind() {
  for (const TermEntry* second : term_catalogue()) {
    if (second->after == nullptr || !growth_.active.estimates(second->after()) || growth_.active.estimates(*second))
      continue;
    Growth with = growth_;
    with.active.sensor = fit_.sensor;
    second->start(with.active.sensor);
    OutputErrorFit other = fit(with);
    if (other.summary.status != Status::unusable && gain(other, fit_) < kTie)
      grown_.others.push_back(
          {std::string(second->after().label), std::string(second->label), second->decider, std::move(other)});
  }
}

void Grower::warn_of_missing(const ScoreTest& test) {
  if (test.candidates.empty() || test.chi_square <= 1.3) return;
  const ScoreCandidate& first = test.candidates.front();
  const double threshold = threshold_of(*first.term, options_.score_threshold);
  if (first.score < threshold) return;
  grown_.warnings.push_back(
      fmt::format("the records hold a term {} (score {:.0f}, threshold {:.0f}) that the rotor model does not have",
                  label({first.term, first.place}, growth_), first.score, threshold));
}

}  // namespace

GrownRotor grow_rotor(const std::vector<RotorRecord>& records, const RotorModel& start,
                      const std::vector<Complex>& start_eps, const OutputErrorOptions& active,
                      const RotorIdentifyOptions& options, bool search_modes) {
  const double main_frequency = std::sqrt(start.k1);
  Growth growth{active, start, 0, hammer_modes(options, main_frequency), {}, {}};
  if (options.terms) growth.terms = candidate_terms(records, main_frequency);
  for (const CandidateMode& c : growth.modes) growth.decays.push_back({{c.mode.omega, c.mode.zeta}});
  double top = 0;
  for (const RotorRecord& r : records) top = std::max(top, r.speed_high());
  if (options.terms) {
    const std::vector<CandidateMode> above = modes_above(std::max(top, main_frequency));
    growth.modes.insert(growth.modes.end(), above.begin(), above.end());
  }
  if (search_modes) {
    const std::vector<CandidateMode> more = searched_modes(top, main_frequency);
    growth.modes.insert(growth.modes.end(), more.begin(), more.end());
  }
  return Grower(records, std::move(growth), start_eps, options).run();
}

}  // namespace whirl::identification::detail
