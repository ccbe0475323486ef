#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "growth/rotor_search.hpp"
#include "rules/rules.hpp"
#include "terms/catalogue.hpp"
#include "whirl/core/parallel.hpp"

/// From the end of the search to the model.
namespace whirl::identification::detail {
double RotorSearch::misfit() const {
  return usable() ? std::max(grown_.chi_square, fit_.summary.chi_square) : INFINITY;
}

GrownRotor RotorSearch::finish() && {
  if (usable()) {
    if (!given_ && misfit() < rules::kNoTrust) {  // what leaves more is not trusted whatever stands in it
      searched_ = tried_in_all_;
      prune();
      find_others();
    }
    settle();
    const bool both = !std::ranges::all_of(records_, &RotorRecord::one_axis);
    grown_.absent = absent_terms(records_, fit_, growth_.active, growth_.terms, options_.terms && both, growth_.forces);
  }
  grown_.fit = std::move(fit_);
  grown_.active = growth_.active;
  grown_.bow = growth_.bow;
  return std::move(grown_);
}

/// Of a model that leaves something, not all is asked.
bool RotorSearch::spent_at_end() const {
  constexpr double kMost = 150;
  return misfit() > rules::kModelError && tried_in_all_ > searched_ + kMost;
}

/// The parameters that `less` lacks are so many deviations from 0 that no fit without them needs to be tried. A term
/// that another one replaces has wide deviations beside it.
bool RotorSearch::beyond_doubt(const Growth& less) const {
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
void RotorSearch::prune() {
  if (taken_.size() < 2) return;
  bool changed = false;
  for (auto at = taken_.begin(); at != taken_.end();) {
    const std::optional<Growth> less = without_term(growth_, at->term);
    if (spent_at_end() || (less && beyond_doubt(*less))) {
      ++at;
      continue;
    }
    OutputErrorFit without;
    if (less) without = fit_from_either(*less, at->before);
    if (less) count(without, *less);
    if (!less || without.summary.status == Status::unusable ||
        plausible_gain(without, fit_) >= threshold_of(*at->term.entry, options_.score_threshold)) {
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
void RotorSearch::find_others() {
  const auto is_taken = [&](const TermId& term) {
    return std::any_of(taken_.begin(), taken_.end(), [&](const Taken& t) { return t.term == term; });
  };
  struct Replaced {
    const Near* near;
    Growth with;
    OutputErrorFit fit = {};
  };
  std::vector<Replaced> replaced;
  for (const Near& near : near_) {
    if (!is_taken(near.taken) || is_taken(near.other)) continue;
    if (const std::optional<Growth> less = without_term(growth_, near.taken))
      replaced.push_back({&near, with_term(*less, near.other, options_.refine_poles)});
  }
  const auto run = [&](int i) {
    Replaced& r = replaced[static_cast<std::size_t>(i)];
    r.fit = fit_from_either(r.with, r.near->with);
  };
  const auto weigh = [&](int i) {
    auto& [near, with, fitted] = replaced[static_cast<std::size_t>(i)];
    OutputErrorFit trial = std::move(fitted);  // its motions go with it
    count(trial, growth_);
    if (trial.summary.status != Status::unusable && plausible_gain(trial, fit_) < rules::kToldApart)
      grown_.others.push_back({label(near->taken, growth_), label(near->other, growth_),
                               std::min(near->taken.entry->decider, near->other.entry->decider), std::move(trial)});
  };
  parallel_trials(
      static_cast<int>(replaced.size()), most_, [&] { return spent_at_end(); }, run, weigh);
  find_second_kind();
  if (fit_.summary.chi_square > rules::kAnotherModel) return;  // every term shows a sign of what is missing
  std::vector<std::pair<const ScoreCandidate*, OutputErrorFit>> more;
  for (const ScoreCandidate& c : grown_.test.candidates)
    if (c.term->in_model && c.term->hinted && !(c.score < rules::kHint)) more.emplace_back(&c, OutputErrorFit{});
  const auto run_hinted = [&](int i) {
    auto& [c, trial] = more[static_cast<std::size_t>(i)];
    const Growth with = with_term(growth_, {c->term, c->place}, options_.refine_poles);
    if (too_many(with))
      trial.summary.status = Status::unusable;
    else
      trial = fit(with);
  };
  const auto weigh_hinted = [&](int i) {
    const auto& c = more[static_cast<std::size_t>(i)].first;
    OutputErrorFit trial = std::move(more[static_cast<std::size_t>(i)].second);
    if (trial.summary.status != Status::unusable && plausible_gain(fit_, trial) >= rules::kToldApart)
      grown_.others.push_back({"", std::string(c->term->label), c->term->decider, std::move(trial)});
  };
  parallel_trials(
      static_cast<int>(more.size()), most_, [] { return false; }, run_hinted, weigh_hinted);
}

/// An error of the probes that needs one of the model in its place.
void RotorSearch::find_second_kind() {
  for (const TermEntry* second : term_catalogue()) {
    if (second->after == nullptr || !growth_.active.estimates(second->after()) || growth_.active.estimates(*second))
      continue;
    Growth with = growth_;
    with.active.probes.start = fit_.sensor;
    second->start(with.active.probes.start);
    OutputErrorFit other = fit(with);
    if (other.summary.status != Status::unusable && gain(other, fit_) < rules::kToldApart)
      grown_.others.push_back(
          {std::string(second->after().label), std::string(second->label), second->decider, std::move(other)});
  }
}

}  // namespace whirl::identification::detail
