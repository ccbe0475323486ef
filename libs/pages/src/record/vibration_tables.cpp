#include "whirl/pages/vibration_tables.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "whirl/core/angles.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/units.hpp"

namespace whirl::pages {
namespace {

using diagnosis::MachineClass;
using report::Align;
constexpr MachineClass kClasses[] = {{1, false}, {1, true}, {2, false}, {2, true}};

std::string rpm_text(double speed) { return fmt::format("{:.0f} rpm", speed / report::kRpm.factor); }

std::string zones_text(const diagnosis::ChannelVibration& channel, const std::optional<MachineClass>& machine) {
  if (machine) return zone_text(diagnosis::housing_zone(channel, *machine));
  std::string out;
  for (const MachineClass& c : kClasses)
    out += fmt::format("{}{} ({})", out.empty() ? "" : ", ", zone_text(diagnosis::housing_zone(channel, c)),
                       diagnosis::to_string(c));
  return out;
}

std::string velocity_text(double v) { return report::format_quantity(v, Quantity::velocity); }

bool any_run(const std::vector<RunVibration>& rows) {
  return std::ranges::any_of(rows, [](const RunVibration& r) { return !r.run.empty(); });
}

}  // namespace

std::string zone_text(const diagnosis::HousingZone& zone) {
  return fmt::format("{}{}", zone.zone, zone.at_least ? " or worse" : "");
}

report::Table vibration_table(const std::vector<RunVibration>& rows) {
  report::Table t;
  const bool runs = any_run(rows);
  t.caption = "Vibration of each channel";
  if (runs) t.columns.push_back({"run", "", Align::left});
  for (const char* name : {"channel", "quantity"}) t.columns.push_back({name, "", Align::left});
  for (const char* name : {"mean", "largest, peak", "rms", "largest line, peak", "1X, peak"})
    t.columns.push_back({name, ""});
  for (const auto& [run, v] : rows) {
    const auto shown = [q = v.quantity](double value) { return report::format_quantity(value, q); };
    std::vector<std::string> cells;
    if (runs) cells.push_back(run);
    cells.insert(
        cells.end(),
        {v.channel, std::string(to_string(v.quantity)), shown(v.mean), shown(v.largest), shown(v.rms),
         v.frequency > 0 ? fmt::format("{} at {} Hz", shown(v.line), report::format_number(v.frequency)) : "–",
         v.synchronous ? fmt::format("{} {} {}", shown(v.synchronous->amplitude),
                                     v.synchronous->steady ? "at" : "(largest) at", rpm_text(v.synchronous->speed))
                       : "–"});
    t.add(std::move(cells));
  }
  t.notes = {"Largest and rms are those of the motion about the mean. The mean of a displacement probe is its gap."};
  if (std::ranges::any_of(rows, [](const RunVibration& r) { return r.channel.struck; }))
    t.notes.emplace_back(
        "A record of hammer impacts has no largest line: its spectrum is that of transients. `whirl frf` and `whirl "
        "modes` read it.");
  return t;
}

report::Table housing_table(const std::vector<RunVibration>& rows, const std::optional<MachineClass>& machine) {
  report::Table t;
  const bool runs = any_run(rows);
  t.caption = "Housing vibration (ISO 20816-3): velocity, rms, 10 Hz to 1 kHz";
  if (runs) t.columns.push_back({"run", "", Align::left});
  t.columns.push_back({"channel", "", Align::left});
  for (const char* name : {"velocity", "largest block", "left out below"}) t.columns.push_back({name, ""});
  if (machine) {
    for (const char* name : {"A/B", "B/C", "C/D"}) t.columns.push_back({name, ""});
  }
  t.columns.push_back({"zone", "", Align::left});
  std::vector<std::string> said;
  bool integrated = false, passage = false;
  double block = 0;
  for (const auto& [run, v] : rows) {
    if (!v.housing) continue;
    std::vector<std::string> cells;
    if (runs) cells.push_back(run);
    cells.insert(cells.end(), {v.channel, velocity_text(v.housing->rms), velocity_text(v.housing->largest),
                               velocity_text(v.housing->below)});
    if (machine) {
      for (const char zone : {'A', 'B', 'C'})
        cells.push_back(velocity_text(diagnosis::housing_vibration_limit(zone, *machine)));
    }
    cells.push_back(zones_text(v, machine));
    t.add(std::move(cells));
    integrated = integrated || v.quantity == Quantity::acceleration;
    passage = passage || (v.synchronous && !v.synchronous->steady);
    block = std::max(block, v.housing->block);
    if (v.housing->high < signal::Band{}.high)
      said.push_back(fmt::format("{}: the record ends at {:g} Hz; what lies above is not in its level.", v.channel,
                                 v.housing->high));
    if (v.synchronous && v.synchronous->steady && v.synchronous->speed < kTwoPi * v.housing->low)
      said.push_back(fmt::format("{}: 1X ({}) lies below {:g} Hz and is not in its level.", v.channel,
                                 rpm_text(v.synchronous->speed), v.housing->low));
  }
  if (t.rows.empty()) return t;
  t.notes = {
      fmt::format("Root mean square over Hann blocks of {:g} s. \"Largest block\" is the block with the highest "
                  "level.",
                  block)};
  if (integrated)
    t.notes.emplace_back(
        "Accelerations are integrated in the frequency domain. \"Left out below\" is the velocity below 10 Hz: slow "
        "motion, or drift of the sensor.");
  if (!machine)
    t.notes.emplace_back(
        "The class of the machine is not stated: whirl report takes --machine 1-rigid, 1-flexible, 2-rigid or "
        "2-flexible (group 1: "
        "above 300 kW; group 2: above 15 kW to 300 kW).");
  if (passage)
    t.notes.emplace_back(
        "The zones apply to steady running; the speed of a run changes, and its row is for orientation.");
  t.notes.insert(t.notes.end(), said.begin(), said.end());
  return t;
}

io::Json to_json(const diagnosis::ChannelVibration& v) {
  io::Json out = io::Json::object();
  out.set("channel", v.channel).set("quantity", std::string(to_string(v.quantity)));
  out.set("unit", std::string(si_unit(v.quantity)));
  out.set("mean", v.mean).set("largest_peak", v.largest).set("rms", v.rms);
  if (v.frequency > 0) out.set("line", io::Json::object().set("frequency_hz", v.frequency).set("peak", v.line));
  if (v.synchronous)
    out.set("synchronous", io::Json::object()
                               .set("order", 1.0)
                               .set("peak", v.synchronous->amplitude)
                               .set("speed", v.synchronous->speed)
                               .set("steady", v.synchronous->steady));
  if (v.housing)
    out.set("housing", io::Json::object()
                           .set("velocity_rms", v.housing->rms)
                           .set("largest_rms", v.housing->largest)
                           .set("below_rms", v.housing->below)
                           .set("low_hz", v.housing->low)
                           .set("high_hz", v.housing->high)
                           .set("block_s", v.housing->block));
  return out;
}

}  // namespace whirl::pages
