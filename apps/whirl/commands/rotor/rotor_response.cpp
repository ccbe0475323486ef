#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rotor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/pages/rotor_curves.hpp"
#include "whirl/pages/rotor_runs.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/report/units.hpp"
#include "whirl/report/write_figure.hpp"
#include "whirl/shaft/distrust.hpp"
#include "whirl/shaft/response.hpp"
#include "whirl/shaft/rotor_json.hpp"

namespace whirl::app {
namespace {

struct RotorResponseOptions {
  std::string rotor, out, figure;
  double from_rpm = 0, to_rpm = 0;
  int points = 500;
};

report::Figure response_figure(const Eigen::VectorXd& speed, const std::vector<pages::PlaceCurve>& curves,
                               const std::string& file) {
  report::Figure figure;
  figure.title = "Unbalance response";
  figure.description = "Amplitude and phase lag of the synchronous motion over rotor speed.";
  figure.shared_x = true;
  report::Panel& amplitude =
      figure.panel("", {"rotor speed", report::kRpm}, {"amplitude, peak", {}, report::Scale::logarithmic});
  amplitude.height = 260;
  for (const pages::PlaceCurve& c : curves) amplitude.line(c.name, speed, c.amplitude);
  report::show_y_as(amplitude, Quantity::displacement);
  report::Panel& phase = figure.panel("", {"rotor speed", report::kRpm}, {"phase lag", report::kDegree});
  phase.height = 140;
  for (const pages::PlaceCurve& c : curves) phase.line("", speed, c.phase);
  figure.runs = {std::filesystem::path(file).filename().string()};
  return figure;
}

void rotor_response(const RotorResponseOptions& o, Session& session) {
  const LoadedRotor loaded = load_rotor(o.rotor);
  if (loaded.system.unbalance.norm() == 0 && loaded.system.bow.norm() == 0)
    throw Error(o.rotor + ": no [[unbalance]] and no [[bow]]: nothing moves the rotor");
  if (!(o.to_rpm > o.from_rpm)) throw Error::in_field("--to-rpm", fmt::format("{:g}", o.to_rpm), "above --from-rpm");
  std::vector<double> speeds;
  for (int k = 0; k < o.points; ++k)
    speeds.push_back((o.from_rpm + (o.to_rpm - o.from_rpm) * k / (o.points - 1)) * kRadPerSecPerRpm);
  const shaft::Response r = pages::refined_response(loaded.rotor, loaded.system, speeds);
  const Eigen::VectorXd speed =
      Eigen::Map<const Eigen::VectorXd>(r.speeds.data(), static_cast<Eigen::Index>(r.speeds.size()));
  const std::vector<pages::PlaceCurve> curves = pages::place_curves(loaded.rotor, loaded.system, r);
  if (curves.empty()) throw Error(o.rotor + ": no [[probe]] and no [[disc]]: nothing to look at");
  report::Table table;
  table.caption = "resonances";
  table.columns = {{"place", ""}, {"speed", "rpm"}, {"peak, 0-p", "um"}, {"amplification", "times"}};
  std::vector<shaft::Reading> readings;
  for (const pages::PlaceCurve& c : curves) {
    readings.push_back({c.name, c.position, c.angle, shaft::peaks(r.speeds, c.amplitude)});
    for (const shaft::Peak& p : readings.back().peaks)
      table.add({c.name, report::format_fixed(p.speed / kRadPerSecPerRpm, 1),
                 report::format_number(1e6 * p.amplitude, 4), report::format_number(p.amplification, 3)});
  }
  if (std::ranges::any_of(readings, [](const shaft::Reading& place) {
        return std::ranges::any_of(place.peaks, [](const shaft::Peak& p) { return !std::isfinite(p.amplification); });
      }))
    table.notes.emplace_back(
        "Amplification: speed over the width at 0.707 of the peak. \"–\": on one side the curve does not fall so far "
        "before the next resonance or the end of the range, and there is no such width.");
  session.say(table.rows.empty() ? "no resonance in this range" : report::to_text(table));
  Summary summary;
  shaft::carry_distrust(loaded.rotor, Consequence::no_trust, summary);
  const auto threshold = pages::warn_if_unstable(loaded.system, speeds.front(), speeds.back(), summary);
  session.result(shaft::response_json(readings).set("unstable_from", shaft::threshold_json(threshold)));
  session.write_together();
  if (!o.out.empty()) {
    io::Table file;
    io::CsvWriteOptions csv;
    csv.units = {"speed_rpm"};
    file.columns.push_back({"speed", Quantity::angular_velocity, speed});
    for (const pages::PlaceCurve& c : curves) {
      const std::string name = pages::column_name(c.name);
      file.columns.push_back({name + "_amp", Quantity::displacement, c.amplitude});
      file.columns.push_back({name + "_phase", Quantity::angle, c.phase});
      csv.units.push_back(name + "_amp_um");
      csv.units.push_back(name + "_phase_deg");
    }
    io::write_csv(o.out, file, csv);
  }
  if (!o.figure.empty()) report::write_figure(response_figure(speed, curves, o.rotor), o.figure);
  session.finish(summary);
}

}  // namespace

void add_rotor_response(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorResponseOptions>();
  CommandLine* sub =
      add_command(rotor, session, "response", "Response to unbalance and bow over speed",
                  "Input: a rotor file with [[unbalance]] or [[bow]]. Read at its probes, or without any at the discs "
                  "(larger half axis of\n"
                  "the orbit). The amplification factor is speed over the width of a peak at 0.707 of its height (API "
                  "684). --out writes\n"
                  "speed_rpm and, of each probe, NAME_amp_um (zero-to-peak) and NAME_phase_deg (lag).\n\n"
                  "Example: whirl rotor response rotor.toml --from-rpm 100 --to-rpm 4000 --figure response.svg",
                  [o, &session] { rotor_response(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--from-rpm", o->from_rpm, "lowest speed")->range(0, 1e7)->show_default();
  sub->add_option("--to-rpm", o->to_rpm, "highest speed")->range(1e-3, 1e7)->required();
  sub->add_option("--points", o->points, "speeds")->range(3, 100000)->show_default();
  sub->add_option("--out", o->out, "CSV file to write")->output("table");
  sub->add_option("--figure", o->figure, "amplitude and phase over speed (.svg, .png, .pdf, .csv)")->output();
}

}  // namespace whirl::app
