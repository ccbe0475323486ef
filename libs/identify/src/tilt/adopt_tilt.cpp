#include "tilt/adopt_tilt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "evidence/rotor_ambiguity.hpp"
#include "evidence/verdict.hpp"
#include "rules/rules.hpp"
#include "whirl/core/angles.hpp"

namespace whirl::identification::detail {
namespace {

bool explained(const RotorIdentification& found) {
  return found.model.summary.status != Status::unusable &&
         std::max(found.chi_square_weak, found.fit.summary.chi_square) < rules::kModelError;
}

/// Whether the plain rotor leaves something, or reads it as a mode that it had to search for.
bool asks_for_more(const RotorIdentification& found, const RotorIdentifyOptions& options) {
  if (!options.search_modes || found.fit.records.empty()) return false;
  const bool searched = !options.modal && found.mode_found;
  return searched || !explained(found);
}

/// The share of the likelihood that a mode found by search has to bring (identify_rotor.hpp).
bool clearly_better(const IdentifiedModel& tilting, const RotorIdentification& found, const RotorRecord& record,
                    const RotorIdentifyOptions& options) {
  // The likelihoods are those of all frequencies, as that of the plain rotor is.
  const double left = tilting.summary.residual / tilting.noise_sd, values = 2 * static_cast<double>(record.size());
  return tilting.summary.chi_square < rules::kModelError &&
         values * (found.fit.summary.chi_square - left * left) / std::max(1.0, left * left) >
             rules::kOfSearch * options.score_threshold;
}

}  // namespace

void judge_tilt(const RotorRecord& record, double peak, IdentifiedModel& model) {
  Summary& s = model.summary;
  for (const std::string& w : record.summary.warnings) s.warn(w);
  judge_chi_square(s.chi_square, "", s);
  const Estimate& ratio = *model.parameter("polar_ratio");
  const double high = record.speed_high() * kHzPerRadPerSec,
               upper = model.parameter("second_frequency")->value * kHzPerRadPerSec;
  if (upper > high)
    s.warn(
        fmt::format("the upper mode at {:.4g} Hz lies above the highest speed {:.1f} Hz: do not predict beyond that "
                    "speed",
                    upper, high));
  std::string trust = fmt::format(
      "Trust the motion it predicts from {:.1f} to {:.1f} Hz up to {:.2g} mm (radius): a disc that tilts, "
      "found in this record alone.",
      record.speed_low() * kHzPerRadPerSec, high, 1e3 * peak);
  // Ratio. Steel alone has about 1e-4 (Cremer and Heckl, Structure-Borne Sound); joints and bearings add to it.
  constexpr double kLeastDamping = 5e-4;
  if (model.parameter("c_tilt")->high < 2 * kLeastDamping * upper / kHzPerRadPerSec)
    trust += fmt::format(
        " Its upper mode does not decay: a vibration from outside at {:.4g} Hz (a neighbour machine, hum) reads alike; "
        "to decide: a record at rest.",
        upper);
  else if (ratio.covers(0))
    s.warn(
        "a support that moves reads alike: k1, c and e are those of the disk only where its supports stay at rest; to "
        "decide: a hammer test (--modes), or a second plane of probes");
  trust += " Laws, balancing and margins are for a disc that does not tilt and do not take this model.";
  if (ratio.value + rules::kImpossible * ratio.sd < 0 || ratio.value - rules::kImpossible * ratio.sd > 2) {
    s.add({FindingCode::inertia_impossible, Consequence::no_trust, {{"polar_ratio", ratio.value}}});
    return;
  }
  set_trust(trust, s);
}

RotorIdentification rotor_or_tilt(const std::vector<Recording>& recordings, const RotorIdentifyOptions& options) {
  RotorIdentification found = identify_rotor_detailed(recordings, options);
  const bool displacement = found.model.quantity == Quantity::displacement;
  if (recordings.size() != 1 || !displacement || options.angle_source != AngleSource::measured ||
      !asks_for_more(found, options))
    return found;
  // One axis does not tell the forward mode of a tilting disc from the backward one.
  if (!recordings.front().has(options.record.x) || !recordings.front().has(options.record.y)) return found;
  const RotorRecord record = rotor_record(recordings.front(), options.record);
  const double target = std::sqrt(std::min(rules::kModelError.limit, found.fit.summary.chi_square));
  std::optional<IdentifiedModel> tilting = fit_tilt_rotor(record, found.fit.model, target);
  if (!tilting || !clearly_better(*tilting, found, record, options)) return found;
  if (explained(found))
    hold_other_kind(*tilting, found.model,
                    fmt::format("a disc that tilts, or {}: both explain the record", fmt::join(found.added, " with ")),
                    Decider::hammer_test);
  judge_tilt(record, (record.z.array() - found.fit.model.offset).abs().maxCoeff(), *tilting);
  tilting->provenance = found.model.provenance;
  found.model = std::move(*tilting);
  return found;
}

IdentifiedModel tilt_of(const Recording& recording, const IdentifiedModel& like, const RotorIdentifyOptions& options) {
  const std::optional<IdentifiedModel> found = fit_tilt_rotor(rotor_record(recording, options.record), like);
  if (found) return *found;
  IdentifiedModel none;
  none.summary.fail("no disc that tilts follows it");
  return none;
}

}  // namespace whirl::identification::detail
