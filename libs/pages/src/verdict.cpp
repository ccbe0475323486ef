#include "whirl/pages/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/diagnosis/standards.hpp"
#include "whirl/pages/text/findings.hpp"
#include "whirl/pages/vibration_tables.hpp"
#include "whirl/report/format.hpp"

namespace whirl::pages {
namespace {

constexpr double kAtSpeed = 0.02;   // of the speed judged
constexpr double kExtremes = 1e-3;  // of the samples at either end

double robust_peak_to_peak(std::vector<double> samples) {
  const auto out = static_cast<std::ptrdiff_t>(kExtremes * static_cast<double>(samples.size()));
  const auto low = samples.begin() + out, high = samples.end() - 1 - out;
  std::nth_element(samples.begin(), low, samples.end());
  const double bottom = *low;
  std::nth_element(samples.begin(), high, samples.end());
  return *high - bottom;
}

void judge_zone(Verdict& v, const Recording& record, double service_speed) {
  const auto turning = diagnosis::rotation_of(record);
  if (!turning) return;
  v.steady = diagnosis::at_one_speed(*turning);
  v.speed = service_speed > 0 ? service_speed : turning->highest_speed();
  for (const Channel& c : record.channels) {
    if (c.quantity != Quantity::displacement) continue;
    std::vector<double> samples;
    for (Eigen::Index i = 0; i < turning->size(); ++i) {
      const double value = c.samples[turning->first + i];
      if (std::abs(turning->speed[i] - v.speed) < kAtSpeed * v.speed && std::isfinite(value)) samples.push_back(value);
    }
    if (samples.size() < 16) continue;
    const double size = robust_peak_to_peak(std::move(samples));
    if (size <= v.peak_to_peak) continue;
    v.peak_to_peak = size;
    v.channel = c.name;
    v.zone = diagnosis::shaft_vibration_zone(size, v.speed);
  }
}

std::vector<const diagnosis::VibrationFinding*> told(const Verdict& v) {
  std::vector<const diagnosis::VibrationFinding*> out;
  for (const diagnosis::VibrationFinding& f : v.vibration.findings)
    if (f.remarkable || f.code == diagnosis::VibrationCode::first_order) out.push_back(&f);
  return out;
}

std::string next_steps(const Verdict& v) {
  std::vector<std::string> steps;
  const auto add = [&](std::string step) {
    if (!step.empty() && std::ranges::count(steps, step) == 0) steps.push_back(std::move(step));
  };
  const char worst = std::max(v.zone, v.housing_zone ? v.housing_zone->zone : '\0');
  if (worst == 'D' && v.steady) add("stop or limit the speed: zone D may damage the machine");
  // Orders of a speed that was taken from the vibration itself are a guess: nothing is done on it.
  if (v.vibration.angle == diagnosis::AngleSource::vibration) {
    add(fmt::format("record with a tacho: {:.0f} rpm is taken from the largest line",
                    v.vibration.low_speed / kRadPerSecPerRpm));
    return fmt::format("{}", fmt::join(steps, "; "));
  }
  if (worst >= 'C' && !v.steady)
    add(fmt::format("record at the service speed: zone {} of a run is for orientation", worst));
  // 1X alone asks for balancing where the zone does.
  for (const auto* f : told(v))
    if (f->remarkable ||
        (f->code == diagnosis::VibrationCode::first_order && v.steady && (worst == 'C' || worst == 'D')))
      add(next_step(*f));
  if (steps.empty()) return v.vibration.angle == diagnosis::AngleSource::none ? "record with a tacho" : "none";
  return fmt::format("{}", fmt::join(steps, "; "));
}

}  // namespace

Verdict verdict_on(const std::string& name, const Recording& record, double service_speed) {
  Verdict v;
  v.record = name;
  try {
    v.vibration = diagnosis::find_vibration(record);
    judge_zone(v, record, service_speed);
  } catch (const Error&) {
    // An angle that cannot be read: the figures that need it say why.
  }
  return v;
}

report::Table verdict_table(const std::vector<Verdict>& verdicts, const Signature& signature) {
  using report::Align;
  report::Table t;
  t.caption = "Verdict";
  t.columns = {{"record", "", Align::left}};
  const auto stated = [](const std::string& text) { return text.empty() ? std::string("not stated") : text; };
  const auto joined = [](const std::vector<std::string>& parts, const char* none) {
    return parts.empty() ? std::string(none) : fmt::format("{}", fmt::join(parts, "; "));
  };
  std::vector<std::vector<std::string>> rows{{"machine"}, {"date"},     {"analyst"},  {"standard"},
                                             {"zone"},    {"findings"}, {"next step"}};
  for (const Verdict& v : verdicts) {
    t.columns.push_back({v.record, "", Align::left});
    std::vector<std::string> findings, standard, zone;
    if (v.vibration.angle == diagnosis::AngleSource::vibration)
      findings.push_back(fmt::format("speed not measured; at {:.0f} rpm", v.vibration.low_speed / kRadPerSecPerRpm));
    for (const auto* f : told(v)) findings.push_back(short_text(*f));
    if (v.zone) {
      standard.push_back(fmt::format("ISO 20816-3 shaft: {} p-p at {:.0f} rpm (channel {})",
                                     report::format_quantity(v.peak_to_peak, Quantity::displacement),
                                     v.speed / kRadPerSecPerRpm, v.channel));
      zone.push_back(fmt::format("{}{}", v.zone, v.steady ? "" : " (the speed changes: for orientation)"));
    }
    if (v.velocity > 0) {
      standard.push_back(fmt::format("ISO 20816-3 housing: {} (channel {}){}",
                                     report::format_amplitude(v.velocity, AmplitudeKind::rms, Quantity::velocity),
                                     v.housing_channel, v.housing_zone ? "" : ", no zone: see findings"));
      if (v.housing_zone) zone.push_back(zone_text(*v.housing_zone));
    }
    const std::string cells[] = {stated(signature.machine),
                                 stated(signature.date),
                                 stated(signature.analyst),
                                 joined(standard, "–"),
                                 joined(zone, "–"),
                                 joined(findings, "none"),
                                 next_steps(v)};
    for (std::size_t k = 0; k < rows.size(); ++k) rows[k].push_back(cells[k]);
  }
  for (std::vector<std::string>& row : rows) t.add(std::move(row));
  t.notes = {
      "Zone: unfiltered shaft vibration at the service speed, or the highest of the record, and velocity of the "
      "housing, "
      "against the limits of ISO 20816-3 as commonly quoted: guidance, not a statement of compliance. Findings: those "
      "of a tenth of the largest "
      "line of their channel or more; what they may mean is no proof."};
  return t;
}

}  // namespace whirl::pages
