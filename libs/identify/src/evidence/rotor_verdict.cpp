#include "evidence/rotor_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "evidence/omitted_terms.hpp"
#include "evidence/verdict.hpp"
#include "rules/rules.hpp"
#include "terms/catalogue.hpp"
#include "whirl/core/angles.hpp"

namespace whirl::identification::detail {

namespace {

// Residual beyond the noise over the motion of the main mode, both rms.
double unexplained_share(const std::vector<RotorRecord>& records, const OutputErrorFit& fit) {
  double excess = 0, motion = 0;
  for (std::size_t r = 0; r < records.size(); ++r) {
    const OutputErrorRecord& f = fit.records[r];
    const double mean_square = f.rmse_x * f.rmse_x + f.rmse_y * f.rmse_y;
    const double noise = records[r].noise_sd() * records[r].noise_sd();
    excess += std::max(0.0, static_cast<double>(records[r].size()) * mean_square - records[r].readings() * noise);
    motion += (records[r].one_axis() ? 0.5 : 1.0) * f.as_read().squaredNorm();
  }
  return std::sqrt(excess / motion);
}

/// What the records cover and what the fit leaves of them.
struct Cover {
  double residual = 0;              // rms, as read
  double peak = 0;                  // m, radius
  double low = INFINITY, high = 0;  // Hz
};

Cover cover_of(const std::vector<RotorRecord>& records, const OutputErrorFit& fit) {
  Cover cover;
  double squares = 0, samples = 0;
  for (std::size_t r = 0; r < records.size(); ++r) {
    const OutputErrorRecord& f = fit.records[r];
    squares += static_cast<double>(records[r].size()) * (f.rmse_x * f.rmse_x + f.rmse_y * f.rmse_y);
    samples += records[r].readings();
    cover.peak = std::max(cover.peak, f.main.cwiseAbs().maxCoeff());
    cover.low = std::min(cover.low, records[r].speed_low() * kHzPerRadPerSec);
    cover.high = std::max(cover.high, records[r].speed_high() * kHzPerRadPerSec);
  }
  cover.residual = std::sqrt(squares / samples);
  return cover;
}

/// Parameters that the records do not determine.
void judge_parameters(const IdentifiedModel& model, const Cover& cover, Summary& summary) {
  const auto relative = [&](const char* name) {
    const Estimate& e = *model.parameter(name);
    return e.sd / std::abs(e.value);
  };
  if (!(relative("k1") < rules::kSpringOpen)) {
    summary.fail(
        fmt::format("the stiffness is not determined by these records (+-{:.0f} %): run through the critical speed",
                    196 * relative("k1")));
  }
  if (!(relative("e") < rules::kUnbalanceOpen)) summary.fail("the unbalance is not determined by these records");
  const Estimate& c = *model.parameter("c");
  if (c.high < 0) {
    summary.fail("the damping is negative: the rotor is unstable or the angle is wrong");
  } else if (c.low < 0) {
    summary.warn(fmt::format("the damping is not determined: c between {:.3g} and {:.3g} 1/s", c.low, c.high));
  }
  const Estimate& k2 = *model.parameter("k2");
  if (k2.covers(0)) {
    summary.warn(
        fmt::format("the cubic stiffness is not determined by an amplitude of {:.3g} mm (k2 between {:.3g} and "
                    "{:.3g} 1/(m^2 s^2)): use a record with more unbalance",
                    1e3 * cover.peak, k2.low, k2.high));
  }
}

/// The angle, the sensors and speeds that were not passed.
void judge_reach(const RotorIdentification& result, const Cover& cover, double share, Summary& summary) {
  const auto& [residual, peak, low, high] = cover;
  const double critical = result.model.rotor->natural_frequency() * kHzPerRadPerSec;
  if (critical > high || critical < low) {
    summary.warn(fmt::format("the critical speed {:.2f} Hz lies outside the speeds of the records, {:.1f} to {:.1f} Hz",
                             critical, low, high));
  }
  judge_chi_square(summary.chi_square,
                   fmt::format("; all intervals are widened by {:.2g}",
                               std::sqrt(std::max(summary.chi_square, result.fit.summary.chi_square))),
                   summary, share);
  for (std::size_t k = 0; k < result.model.rotor->modes.size(); ++k) {
    const ForcedMode& m = result.model.rotor->modes[k];
    if (m.omega * kHzPerRadPerSec > high && static_cast<int>(k) != result.active.modes.given) {
      summary.warn(
          fmt::format("the mode at {:.4g} Hz lies above the highest speed {:.1f} Hz: it was not passed, do not "
                      "predict beyond that speed",
                      m.omega * kHzPerRadPerSec, high));
    }
  }
  if (result.active.clock.delay) {
    summary.warn(fmt::format(
        "the {} lags the angle by {:.3g} ms; the phase of e rests on this{}: give the known "
        "sensor delay, or check the angle",
        to_string(result.model.quantity), 1e3 * result.fit.delay,
        result.fit.delay < 0 || result.fit.delay > 5e-3 ? " (implausible for a sensor: rather an error of the angle)"
                                                        : ""));
  }
  if (result.active.clock.profile_degree > 0 && summary.chi_square > rules::kModelError) {
    summary.warn(fmt::format("the angle is not the assumed profile corrected by a polynomial of degree {}: measure it",
                             result.active.clock.profile_degree));
  }
  // Near standstill the probes see runout alone; without such a stretch it is part of e.
  const bool probes = result.model.quantity == Quantity::displacement;
  if (probes && result.active.probes.runout_harmonics == 0 && low > rules::kNearStandstill * critical) {
    summary.warn(fmt::format(
        "the records do not go below {:.1f} Hz: shaft runout cannot be distinguished from the unbalance and is "
        "part of e",
        low));
  }
}

/// Springs and dampers that differ from record to record.
void state_own_springs(const std::vector<RotorRecord>& records, const IdentifiedModel& model, Summary& summary) {
  for (std::size_t r = 1; r < records.size(); ++r) {
    for (const char* name : {"k1", "c"}) {
      const Estimate* change = model.parameter(fmt::format("{}_change_{}", name, r + 1));
      if (change == nullptr || change->covers(0)) continue;
      const double share = 100 / model.parameter(name)->value;
      summary.warn(fmt::format(
          "{} of {} is {:+.3g} +- {:.1g} % beyond that of {}: the machine changed between the records "
          "(temperature, tension of a belt); the model has that of {}",
          name, records[r].source, share * change->value, share * change->sd, records[0].source, records[0].source));
    }
  }
}

/// A whirl that grows by itself.
void state_self_excited(const OutputErrorFit& fit, const Cover& cover, Summary& summary) {
  const double from = unstable_from(fit.model, fit.terms, cover.high / kHzPerRadPerSec);
  if (!std::isfinite(from)) return;
  std::vector<RotorTerm> driving;
  std::ranges::copy_if(fit.terms, std::back_inserter(driving),
                       [](const RotorTerm& t) { return t.entry->drives_whirl; });
  if (driving.empty()) return;
  summary.warn(fmt::format(
      "the rotor whirls by itself {}: {} is more than the outer damping holds, and small motion grows to a forward "
      "whirl near {:.4g} Hz that does not follow the speed; balancing does not take it away, more outer damping does",
      from > 0 ? fmt::format("from {:.4g} Hz on", from * kHzPerRadPerSec) : "at any speed", names_of(driving),
      fit.model.natural_frequency() * kHzPerRadPerSec));
}

}  // namespace

void judge_rotor(const std::vector<RotorRecord>& records, const RotorIdentification& result, Summary& summary) {
  const Cover cover = cover_of(records, result.fit);
  summary.residual = cover.residual;
  for (const std::string& w : result.fit.summary.warnings) summary.warn(w);
  const double share = unexplained_share(records, result.fit);
  judge_unexplained(share, "the model leaves", "wrong angle, wrong channels or not a rotor on a cubic spring", summary);
  judge_parameters(result.model, cover, summary);
  judge_reach(result, cover, share, summary);
  state_own_springs(records, result.model, summary);
  state_self_excited(result.fit, cover, summary);
  const bool separated =
      std::ranges::any_of(result.fit.terms, [](const RotorTerm& t) { return t.is(terms::cross_coupled()); });
  set_trust(
      fmt::format("Trust the motion it predicts from {:.1f} to {:.1f} Hz up to {:.2g} mm (radius); {}.", cover.low,
                  cover.high, 1e3 * cover.peak,
                  separated ? "c is without the cross-coupled stiffness, which k_cross holds"
                            : "c includes any cross-coupled stiffness k_c as c - k_c / speed, which only a hammer test "
                              "or a free decay can separate"),
      summary);
  judge_sizes(result, summary);
  judge_remaining(summary);
}

}  // namespace whirl::identification::detail
