#include "growth/self_excited.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "record/start_motion.hpp"
#include "rules/rules.hpp"
#include "whirl/identify/output_error_rotor.hpp"

namespace whirl::identification::detail {
namespace {

using Complex = std::complex<double>;

std::vector<RotorRecord> in_parts(const std::vector<RotorRecord>& records, Eigen::Index parts) {
  std::vector<RotorRecord> all;
  for (const RotorRecord& r : records) {
    const Eigen::Index each = r.size() / parts;
    for (Eigen::Index k = 0; k < parts; ++k) all.push_back(segment_of(r, k * each, each));
  }
  return all;
}

/// Output error over `parts` parts of each record, from `start`; the unbalance stays that of the weak equations. False
/// where it does not explain them.
bool refine(const std::vector<RotorRecord>& records, Eigen::Index parts, WhirlStart& whirl) {
  WeakRotorFit& start = whirl.fit;
  OutputErrorOptions options;
  options.terms = start.terms;
  std::vector<Complex> eps;
  for (const Complex& e : start.eps) eps.insert(eps.end(), static_cast<std::size_t>(parts), e);
  const OutputErrorFit fit = fit_output_error_rotor(in_parts(records, parts), start.model, options, eps);
  if (fit.summary.status == Status::unusable) return false;
  whirl.chi_square = std::min(whirl.chi_square, fit.summary.chi_square);
  if (!(fit.summary.chi_square < rules::kNoTrust)) return false;
  whirl.parts = parts;
  whirl.chi_square = fit.summary.chi_square;
  start.model.k1 = fit.model.k1, start.model.k2 = fit.model.k2, start.model.c = fit.model.c;
  start.terms = fit.terms;
  if (parts == 1) {
    for (std::size_t r = 0; r < start.eps.size(); ++r) start.eps[r] = fit.records[r].eps;
  }
  return true;
}

}  // namespace

std::vector<WhirlStart> self_excited_starts(const std::vector<RotorRecord>& records, WeakRotorOptions weak,
                                            const WeakRotorFit& first) {
  constexpr Eigen::Index kMostParts = 16;
  double top = 0;
  for (const RotorRecord& r : records) top = std::max(top, r.speed_high());
  std::vector<WhirlStart> starts;
  for (const TermEntry* entry : term_catalogue()) {
    if (!entry->drives_whirl) continue;
    weak.whirl_force = RotorTerm{entry};
    WhirlStart whirl{fit_weak_rotor(records, weak)};
    const WeakRotorFit& start = whirl.fit;
    const bool explains = first.model.c <= 0 || start.summary.chi_square < rules::kHalf * first.summary.chi_square;
    if (start.summary.status == Status::unusable || !explains || !(start.model.c > 0) ||
        !std::isfinite(whirl.unstable = unstable_from(start.model, start.terms, top)))
      continue;
    if (!refine(records, 1, whirl)) {
      for (Eigen::Index parts = kMostParts; parts > 1 && refine(records, parts, whirl); parts /= 2) {
      }
    }
    starts.push_back(std::move(whirl));
  }
  std::ranges::sort(starts, {}, [](const WhirlStart& w) { return w.fit.summary.chi_square; });
  return starts;
}

std::string WhirlStart::reason() const {
  const RotorTerm& term = fit.terms[0];
  const double from = unstable / (2 * std::numbers::pi);
  return fmt::format(
      "the rotor whirls by itself {}: {} parts of a record, each with a start of its own, follow {} ({} = {:.4g} {}) "
      "beside c = {:.4g} 1/s and k1 = {:.6g} 1/s^2 (chi-square {:.3g}), but no single motion was found that follows a "
      "whole record, where the whirl amplifies every deviation: identify from a record that stays below that speed",
      from > 0 ? fmt::format("from {:.4g} Hz on", from) : "at any speed", parts, term.entry->label, term.parameter(),
      term.value, term.unit(), fit.model.c, fit.model.k1, chi_square);
}

}  // namespace whirl::identification::detail
