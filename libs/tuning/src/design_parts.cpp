#include "design_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/identify/parts/readings.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/tuning/loop_margins.hpp"

namespace whirl::tuning {

bool knows(const Hardware& hardware, const ForcedMode& mode) {
  constexpr double kSame = 0.1;  // of the frequency: loaded by the running machine and at rest
  const double f = mode.omega / (2 * std::numbers::pi);
  return std::ranges::any_of(hardware.modes,
                             [&](const rig::RigMode& m) { return std::abs(m.frequency / f - 1) < kSame; });
}

void state_parts(identification::Consumer consumer, const IdentifiedModel& model, const Hardware& hardware,
                 Summary& summary) {
  IdentifiedModel unknown = model;
  if (unknown.rotor) std::erase_if(unknown.rotor->modes, [&](const ForcedMode& m) { return knows(hardware, m); });
  take_parts(consumer, unknown, summary);
  if (!model.rotor) return;
  for (const identification::RotorTerm& t : forces_left_out(model, hardware)) {
    if (part_of(t) == identification::ModelPart::twice_speed) continue;  // said above
    summary.add({FindingCode::part_left_out,
                 Consequence::warning,
                 {{std::string(t.parameter()), t.value, std::string(t.unit())}},
                 std::string(t.entry->label)},
                ": it changes too fast for the steps of the plants, or pushes");
  }
  const double top = std::max(std::abs(hardware.profile.omega_start), std::abs(hardware.profile.omega_end));
  const std::vector<identification::RotorTerm> terms = identification::terms_of(model);
  const double unstable = identification::unstable_from(*model.rotor, terms, top);
  if (std::isfinite(unstable)) {
    summary.warn(
        fmt::format("with its {} the rotor whirls by itself from {:.0f} rpm on, inside the speed range: nothing but "
                    "the loop holds it there",
                    names_of(terms), unstable * 30 / std::numbers::pi));
  }
}

void hold_on_readings(const IdentifiedModel& model, const DesignOptions& given, ControllerDesign& best) {
  MarginOptions o;
  o.threads = given.threads;
  for (const identification::ModelReading& reading : identification::other_readings(model)) {
    for (const MarginStudy& study : margin_studies(best, reading.model, given, o)) {
      const std::optional<Finding> why = margin_failure(study.speeds, best);
      best.summary.add({FindingCode::readings_differ,
                        why ? Consequence::unusable : Consequence::note,
                        {{"gain margin", worst_margins(study.speeds).gain_up}},
                        reading.reading},
                       why ? ": with it " + text(*why) : "");
      if (why) best.margins["certified"] = 0;
    }
  }
}

}  // namespace whirl::tuning
