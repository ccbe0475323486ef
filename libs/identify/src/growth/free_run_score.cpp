#include "growth/free_run_score.hpp"

#include <algorithm>
#include <cmath>

#include "output_error/score.hpp"
#include "terms/catalogue.hpp"

namespace whirl::identification::detail {
namespace {

/// Places to try of an entry; empty: the model has it, or it is none for these records.
std::vector<int> open_places(const TermEntry& entry, const std::vector<RotorRecord>& records, const Growth& growth,
                             const RotorIdentifyOptions& options) {
  const OutputErrorOptions& active = growth.active;
  if (entry.of_displacement || !entry.in_model || entry.rare) return {};
  if (entry.both_axes && std::ranges::all_of(records, &RotorRecord::one_axis)) return {};
  std::vector<int> places;
  if (&entry == &terms::mode() || &entry == &terms::modes_above()) {
    for (std::size_t k = 0; k < growth.modes.size(); ++k)
      if (growth.modes[k].open && growth.modes[k].above == (&entry == &terms::modes_above()))
        places.push_back(static_cast<int>(k) + 1);
    return places;
  }
  if (&entry == &terms::decay()) {
    for (std::size_t k = 0; k < growth.decays.size(); ++k)
      if (growth.decays[k].open) places.push_back(static_cast<int>(k) + 1);
    return places;
  }
  if (entry.sensor != nullptr) {
    const bool asked = entry.after != nullptr ? active.estimates(entry.after()) : options.terms;
    if (asked && !active.estimates(entry)) places.push_back(0);
  } else if (entry.force != nullptr) {
    const auto of_entry = [&](const RotorTerm& t) { return t.is(entry); };
    if (std::ranges::any_of(growth.terms, of_entry) && std::ranges::none_of(active.terms, of_entry))
      places.push_back(0);
  } else if (&entry != &terms::delay() || options.delay) {
    places.push_back(0);
  }
  return places;
}

/// What has a derivative while the term is 0: neither the pole of a mode nor the charge of a high-pass has one.
bool acts_at_zero(Kind kind) {
  return kind == Kind::lane || kind == Kind::term || kind == Kind::sensor || kind == Kind::participation ||
         kind == Kind::decay;
}

}  // namespace

ScoreTest score_on_free_runs(const std::vector<RotorRecord>& records, const OutputErrorFit& fit, const Growth& growth,
                             const RotorIdentifyOptions& options) {
  ScoreTest test;
  test.chi_square = fit.summary.chi_square;
  test.condition_number = fit.summary.condition_number;
  Growth now = growth;  // where the fit ended
  now.start = fit.model;
  now.active.modes.decays = fit.decays;
  now.active.terms = fit.terms;
  now.active.probes.start = fit.sensor;
  now.active.clock.start_drift = fit.clock_drift;
  now.active.solver.substeps = fit.substeps;
  const auto score = [&](const TermEntry& entry, int place) {
    Growth with = with_term(now, {&entry, place}, false);
    with.active.modes.poles = growth.active.modes.poles;
    OutputErrorFit at = fit;
    at.model.modes = with.start.modes;
    for (OutputErrorRecord& r : at.records) {
      r.participation.resize(with.start.modes.size(), 0);
      r.decay.resize(2 * with.active.modes.decays.size(), 0);
    }
    OutputErrorProblem problem(records, with.active, with.start.modes.size(), with.forces);
    Point point = point_of(at, with.active, problem.parameters());
    std::vector<int> known, added;
    for (std::size_t j = 0; j < problem.parameters().size(); ++j) {
      const Parameter& q = problem.parameters()[j];
      if (fit.index(q.name) >= 0)
        known.push_back(static_cast<int>(j));
      else if (acts_at_zero(q.kind))
        added.push_back(static_cast<int>(j));
    }
    if (added.empty()) return;
    SquareSum sum;
    problem.linearise(point, sum);
    if (!std::isfinite(sum.cost)) return;
    const Evidence e =
        evidence(remainders(sum.normal, sum.gradient, known, {added}).front(), std::max(1.0, fit.summary.chi_square));
    if (!(e.score > 0)) return;
    ScoreCandidate candidate{&entry, place, e.score};
    candidate.coefficient = e.coefficient;
    if (added.size() == 1) candidate.value = e.coefficient[0], candidate.sd = e.sd;
    test.candidates.push_back(std::move(candidate));
  };
  for (const TermEntry* entry : term_catalogue())
    for (const int place : open_places(*entry, records, growth, options)) score(*entry, place);
  std::ranges::sort(test.candidates, std::ranges::greater(), &ScoreCandidate::score);
  return test;
}

}  // namespace whirl::identification::detail
