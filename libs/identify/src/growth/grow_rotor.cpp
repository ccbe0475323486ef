#include "growth/grow_rotor.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "growth/lower_resonance.hpp"
#include "growth/rotor_search.hpp"
#include "growth/self_excited.hpp"
#include "rules/rules.hpp"
#include "whirl/core/parallel.hpp"

namespace whirl::identification::detail {
namespace {

/// Whether the records have springs or dampers of their own (a machine that warmed up between them): the weak equations
/// of each alone against those of the first. `start`: what they give then.
bool part_records(const std::vector<RotorRecord>& records, const WeakRotorOptions& weak, OutputErrorOptions& active,
                  WeakRotorFit& start) {
  std::vector<WeakRotorFit> alone;
  for (const RotorRecord& r : records) {
    alone.push_back(fit_weak_rotor({r}, weak));
    if (alone.back().summary.status == Status::unusable) return false;
  }
  const auto changes = [&](Eigen::Index j) {
    std::vector<double> out;
    bool differ = false;
    const auto variance = [&](const WeakRotorFit& f) {
      return std::max(1.0, f.summary.chi_square) * f.covariance(j, j);
    };
    for (const WeakRotorFit& f : alone) {
      out.push_back(f.values[j] - alone[0].values[j]);
      differ |= std::abs(out.back()) > rules::kRecordsDiffer * std::sqrt(variance(f) + variance(alone[0])) &&
                std::abs(out.back()) > rules::kRecordsMatter * std::abs(alone[0].values[j]);
    }
    return differ ? out : std::vector<double>{};
  };
  start = alone[0];
  for (std::size_t r = 1; r < alone.size(); ++r) start.eps.push_back(alone[r].eps[0]);
  active.changes.k1 = changes(0);
  active.changes.c = changes(2);
  return !active.changes.k1.empty() || !active.changes.c.empty();
}

/// Whether the motions that two searches hold at a time are few enough.
bool small(const std::vector<RotorRecord>& records) {
  constexpr double kMostReadings = 1e5;
  double readings = 0;
  for (const RotorRecord& r : records) readings += r.readings();
  return processors() > 1 && readings < kMostReadings;
}

/// A whirl that drives itself: the best search begun at one, and what is said where none explains the records.
struct Driven {
  std::unique_ptr<RotorSearch> search;
  std::string said;
  double misfit() const { return search ? search->misfit() : INFINITY; }
};
/// `misfit`: of the best search without; `search` begins one. The first that explains the records ends it.
template <class Search>
Driven driven_by_itself(const std::vector<WhirlStart>& starts, double misfit, const OutputErrorOptions& active,
                        const Search& search) {
  Driven best;
  for (const WhirlStart& whirl : starts) {
    // Parts with starts of their own follow a true whirl better than any single motion.
    if (misfit < whirl.chi_square) continue;
    OutputErrorOptions with = active;
    with.terms = whirl.fit.terms;
    std::unique_ptr<RotorSearch> other = search(whirl.fit.model, whirl.fit.eps, with);
    if (whirl.parts > 1 && best.said.empty()) best.said = whirl.reason();
    if (!best.search || other->misfit() < best.misfit()) best.search = std::move(other);
    if (best.misfit() < rules::kModelError) break;
  }
  return best;
}

}  // namespace

GrownRotor grow_rotor(const std::vector<RotorRecord>& records, const std::vector<RotorRecord>& moving,
                      const WeakRotorOptions& weak, WeakRotorFit first, const RotorIdentifyOptions& options,
                      OutputErrorOptions& active) {
  FitMemory memory(records);
  std::unique_ptr<RotorSearch> best;
  const auto misfit = [&] { return best ? best->misfit() : INFINITY; };
  const auto search = [&](const RotorModel& start, const std::vector<std::complex<double>>& eps,
                          const OutputErrorOptions& with, Beside beside = Beside::nothing,
                          std::stop_token unwanted = {}) {
    return std::make_unique<RotorSearch>(records, start, eps, with, options, memory, beside, 0, std::move(unwanted));
  };
  /// A model with more in it that does not explain the records either must leave half of what the simpler one does.
  const auto take = [&](std::unique_ptr<RotorSearch> other, double share) {
    const bool better = other->misfit() < rules::kModelError || other->misfit() < share * misfit();
    if (better || !best) best = std::move(other);
    return better;
  };
  constexpr double kAny = 1;
  const auto found = [&] { return misfit() < rules::kModelError; };

  std::unique_ptr<RotorSearch> lower;
  if (const auto start = options.search_modes ? lower_resonance(moving, weak) : std::nullopt) {
    lower = search(start->model, start->eps, active, Beside::modes);
    if (lower->misfit() < rules::kModelError) return std::move(*lower).finish();
  }
  // Damping that is positive is tried as it is first: whatever is missing need not drive the motion.
  if (first.model.c > 0) take(search(first.model, first.eps, active), kAny);
  const bool displacement = records.front().quantity == Quantity::displacement;
  if (!displacement && !found()) {  // the noise of an integral may hide the cubic spring
    RotorModel linear = first.model;
    linear.k2 = 0;
    take(search(linear, first.eps, active), kAny);
  }
  OutputErrorOptions own = active;
  WeakRotorFit start = first;
  if (records.size() > 1 && !found() && part_records(moving, weak, own, start)) {
    if (!best) take(search(first.model, first.eps, active), kAny);
    if (take(search(start.model, start.eps, own), rules::kHalf)) {
      first = std::move(start);
      active = std::move(own);
    }
  }
  // Where the first of two resonances is followed better than the whole, the terms of the whole are not what is
  // missing.
  const auto two = [&] { return lower && lower->misfit() < rules::kHalf * misfit(); };
  // Begun again with rare terms or with modes of any frequency among the candidates, so that none of the terms taken up
  // so far stands in for one of them. Short records side by side: both are asked for where the first does not explain
  // them.
  std::unique_ptr<RotorSearch> rare, with_modes;
  if (options.terms && displacement && best && !found() && !two()) {
    std::stop_source explained;
    parallel_for(options.search_modes && small(records) ? 2 : 1, 0, [&](int i) {
      if (i == 1) {
        with_modes = search(first.model, first.eps, active, Beside::modes, explained.get_token());
        return;
      }
      rare = search(first.model, first.eps, active, Beside::rare_terms);
      if (rare->misfit() < rules::kModelError) explained.request_stop();
    });
    take(std::move(rare), rules::kHalf);
  }
  // (A whirl of its own is followed over parts of the displacements: not sought in an integral.)
  Driven driven;
  if (options.terms && displacement && !found() &&
      (first.summary.chi_square > rules::kAnotherModel || first.model.c <= 0))
    driven = driven_by_itself(self_excited_starts(records, weak, first), misfit(), active, search);
  if (driven.misfit() < rules::kModelError) return std::move(*driven.search).finish();
  if (!best) take(search(first.model, first.eps, active), kAny);
  if (options.search_modes && best->usable() && !found() && !two())
    take(with_modes ? std::move(with_modes) : search(first.model, first.eps, active, Beside::modes), rules::kHalf);
  for (std::unique_ptr<RotorSearch>* other : {&driven.search, &lower})
    if (*other) take(std::move(*other), rules::kHalf);
  GrownRotor grown = std::move(*best).finish();
  if (!driven.said.empty() && !(grown.misfit() < rules::kModelError)) grown.warnings.push_back(driven.said);
  return grown;
}

GrownRotor fitted_as(const std::vector<RotorRecord>& records, const RotorIdentification& like,
                     const RotorIdentifyOptions& options) {
  OutputErrorOptions active = like.active;
  active.solver.substeps = like.fit.substeps;
  active.clock.profile_degree = options.angle_source == AngleSource::measured ? 0 : options.profile_degree;
  std::vector<std::complex<double>> eps;
  for (std::size_t r = 0; r < records.size(); ++r) eps.push_back(like.fit.records[r].eps);
  for (std::vector<double>* own : {&active.changes.k1, &active.changes.c})
    if (!own->empty()) own->resize(records.size());
  FitMemory memory(records);
  RotorSearch search(records, like.fit.model, eps, active, options, memory, Beside::no_search, like.fit.delay);
  return std::move(search).finish();
}

}  // namespace whirl::identification::detail
