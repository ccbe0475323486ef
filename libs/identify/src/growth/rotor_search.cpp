#include "growth/rotor_search.hpp"

#include <algorithm>
#include <cmath>

namespace whirl::identification::detail {
namespace {

/// The model that the search begins with, and what it may take up.
Growth begin(const std::vector<RotorRecord>& records, const RotorModel& start, const OutputErrorOptions& active,
             const RotorIdentifyOptions& options, Beside beside, double delay) {
  const double main_frequency = std::sqrt(start.k1);
  Growth growth{active, start, delay, hammer_modes(options, main_frequency), {}, {}};
  if (growth.active.probes.start.gain_drift == 0) growth.active.probes.start.drift_start = records.front().t0;
  if (options.terms) growth.terms = candidate_terms(records, main_frequency);
  for (const CandidateMode& c : growth.modes) growth.decays.push_back({{c.mode.omega, c.mode.zeta}});
  double top = 0;
  for (const RotorRecord& r : records) top = std::max(top, r.speed_high());
  if (options.terms) {
    const std::vector<CandidateMode> above = modes_above(std::max(top, main_frequency));
    growth.modes.insert(growth.modes.end(), above.begin(), above.end());
  }
  if (beside == Beside::modes) {
    const std::vector<CandidateMode> more = searched_modes(top, main_frequency);
    growth.modes.insert(growth.modes.end(), more.begin(), more.end());
  }
  return growth;
}

}  // namespace

RotorSearch::RotorSearch(const std::vector<RotorRecord>& records, const RotorModel& start,
                         std::vector<Complex> start_eps, const OutputErrorOptions& active,
                         const RotorIdentifyOptions& options, FitMemory& memory, Beside beside, double delay,
                         std::stop_token unwanted)
    : records_(records),
      options_(options),
      memory_(memory),
      unwanted_(std::move(unwanted)),
      rare_(beside == Beside::rare_terms),
      given_(beside == Beside::no_search),
      modes_(beside == Beside::modes),
      growth_(begin(records, start, active, options, beside, delay)),
      eps_(std::move(start_eps)) {
  for (const RotorRecord& r : records) values_ += r.readings();
  constexpr double kReadingsHeld = 2e5;  // of about 200 bytes
  most_ = static_cast<int>(std::clamp(kReadingsHeld / values_, 1.0, 8.0));
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
  keep_grid();
  if (given_ && usable()) {
    settle();
    test();
  }
  while (!given_ && usable() && !unwanted_.stop_requested() && step()) {
  }
}

}  // namespace whirl::identification::detail
