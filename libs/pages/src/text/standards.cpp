#include "whirl/pages/text/standards.hpp"

#include <fmt/format.h>

#include "whirl/core/angles.hpp"
#include "whirl/report/format.hpp"

namespace whirl::pages {

using report::Callout;

bool add_standard_findings(report::Document& document, const std::vector<Verdict>& runs,
                           const std::vector<BalanceQuality>& models) {
  bool any = false;
  for (const Verdict& v : runs) {
    if (v.zone == 0) continue;
    any = true;
    const Callout::Kind kind = !v.steady       ? Callout::Kind::note
                               : v.zone >= 'C' ? Callout::Kind::warning
                                               : Callout::Kind::agrees;
    document.callout(
        kind, "Shaft vibration of " + v.record,
        fmt::format("Zone {} of ISO 20816-3: {} p-p at {:.0f} rpm in channel {}.{}", v.zone,
                    report::format_quantity(v.peak_to_peak, Quantity::displacement), v.speed / kRadPerSecPerRpm,
                    v.channel, v.steady ? "" : " The speed of the run changes: the zone is for orientation."));
  }
  for (const BalanceQuality& q : models) {
    any = true;
    document.callout(
        q.held <= kGradeOfCentrifuges ? Callout::Kind::agrees : Callout::Kind::warning, "Balance of " + q.model,
        fmt::format("{} of ISO 21940-11 at {:.0f} rpm: eccentricity {}; G 6.3 (centrifuges) allows {} µm.", q.words(),
                    q.speed / kRadPerSecPerRpm, report::format_quantity(q.eccentricity.value, Quantity::displacement),
                    report::format_number(q.allowed(), 3)));
  }
  return any;
}

}  // namespace whirl::pages
