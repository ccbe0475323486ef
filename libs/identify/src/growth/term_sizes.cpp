#include "growth/term_sizes.hpp"

#include <algorithm>
#include <cmath>

#include "rules/rules.hpp"

namespace whirl::identification::detail {
namespace {

/// k1 and c of the rotor hold at the start of a drift and at rest; usual sizes are those in the middle of the run.
TermScale scale_in_middle(const OutputErrorFit& fit) {
  TermScale scale = scale_of(fit.model, fit);
  double c = fit.model.c;
  for (const RotorTerm& t : fit.terms) {
    if (!t.entry->moves_middle) continue;
    const TermForce f = term_force(t, {.w = 0.5 * scale.top_speed, .time = t.reference + 0.5 * scale.seconds});
    scale.k1 -= t.value * f.x_x;
    c -= t.value * f.x_vx;
  }
  scale.c = std::abs(c);
  return scale;
}

}  // namespace

TermScale scale_of(const RotorModel& rotor, const OutputErrorFit& fit) {
  TermScale s{.k1 = rotor.k1, .k2 = rotor.k2, .c = std::abs(rotor.c)};
  for (const OutputErrorRecord& r : fit.records) {
    s.peak = std::max(s.peak, r.main.cwiseAbs().maxCoeff());
    s.top_speed = std::max(s.top_speed, r.angle.omega.cwiseAbs().maxCoeff());
    s.seconds = std::max(s.seconds, 0.5 * r.angle.dt * static_cast<double>(r.angle.beta.size()));
  }
  return s;
}

std::vector<TermSize> sizes_of(const OutputErrorFit& fit) {
  const TermScale scale = scale_in_middle(fit);
  std::vector<TermSize> sizes;
  const auto add = [&](const TermEntry& entry, const TermParameter& parameter, double value) {
    double usual = entry.usual != nullptr ? std::abs(entry.usual(scale)) : 0;
    if (entry.plausible != nullptr) usual = std::max(usual, entry.plausible(scale));
    if (usual > 0 && value != 0) sizes.push_back({&entry, parameter.name, parameter.unit, value, usual});
  };
  for (const RotorTerm& t : fit.terms) add(*t.entry, t.entry->parameters[t.part], t.value);
  for (const TermEntry* entry : term_catalogue()) {
    if (entry->sensor != nullptr) add(*entry, entry->parameters.front(), fit.sensor.*entry->sensor);
  }
  return sizes;
}

double surprise(const OutputErrorFit& fit) {
  double sum = 0;
  for (const TermSize& s : sizes_of(fit)) sum += 4 * std::log(std::max(1.0, s.ratio() / rules::kSurprise));
  return sum;
}

}  // namespace whirl::identification::detail
