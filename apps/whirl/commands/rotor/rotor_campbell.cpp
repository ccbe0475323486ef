#include <fmt/format.h>

#include "rotor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/pages/rotor_curves.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/report/units.hpp"
#include "whirl/report/write_figure.hpp"
#include "whirl/shaft/distrust.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/rotor_json.hpp"

namespace whirl::app {
namespace {

struct RotorCampbellOptions {
  std::string rotor, out, figure;
  double to_rpm = 0;
  int points = 50, count = 6;
};

struct CampbellLine {
  Eigen::VectorXd frequency, damping;
  double direction;  // in the middle of the range
};

std::vector<CampbellLine> campbell_lines(const std::vector<shaft::CampbellPoint>& points, int count) {
  const auto n = static_cast<Eigen::Index>(points.size());
  std::vector<CampbellLine> lines;
  auto found = static_cast<std::size_t>(count);
  for (const shaft::CampbellPoint& p : points) found = std::min(found, p.modes.size());
  for (std::size_t m = 0; m < found; ++m) {
    CampbellLine line{Eigen::VectorXd(n), Eigen::VectorXd(n), points[points.size() / 2].modes[m].direction};
    for (Eigen::Index k = 0; k < n; ++k) {
      const shaft::Mode& mode = points[static_cast<std::size_t>(k)].modes[m];
      line.frequency[k] = mode.frequency();
      line.damping[k] = mode.damping();
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

report::Figure campbell_figure(const Eigen::VectorXd& speed, const std::vector<CampbellLine>& lines,
                               const std::vector<shaft::Critical>& criticals, const std::string& file) {
  report::Figure figure;
  figure.title = "Campbell diagram";
  figure.description = "Frequencies of free whirl and their damping over rotor speed, with the running speed.";
  figure.shared_x = true;
  report::Panel& panel = figure.panel("", {"rotor speed", report::kRpm}, {"frequency", report::kHertzOfAngular});
  panel.height = 320;
  int number = 0;
  for (const CampbellLine& line : lines) {
    const std::string word = whirl_word(line.direction);
    panel.line(fmt::format("{}, {}", ++number, word), speed, line.frequency,
               {.color = word == "forward"    ? 0
                         : word == "backward" ? 1
                                              : 2,
                .dash = word == "backward" ? report::Dash::dashed : report::Dash::solid});
  }
  panel.line("1X", speed, speed, {.color = 7, .dash = report::Dash::dotted});
  Eigen::VectorXd at(static_cast<Eigen::Index>(criticals.size()));
  for (std::size_t k = 0; k < criticals.size(); ++k) at[static_cast<Eigen::Index>(k)] = criticals[k].speed;
  if (at.size() > 0) panel.scatter("critical speed", at, at, {.color = 6});
  panel.y.low = 0;
  report::Panel& damping = figure.panel("", {"rotor speed", report::kRpm}, {"damping ratio", report::kPercentOfOne});
  damping.height = 160;
  number = 0;
  for (const CampbellLine& line : lines) damping.line(fmt::format("{}", ++number), speed, line.damping);
  damping.horizontal(0, "");
  figure.runs = {std::filesystem::path(file).filename().string()};
  return figure;
}

void rotor_campbell(const RotorCampbellOptions& o, Session& session) {
  const LoadedRotor loaded = load_rotor(o.rotor);
  std::vector<double> speeds;
  for (int k = 0; k < o.points; ++k) speeds.push_back(o.to_rpm * kRadPerSecPerRpm * k / (o.points - 1));
  const std::vector<shaft::CampbellPoint> points = shaft::campbell(loaded.system, speeds, o.count);
  Summary summary;
  shaft::carry_distrust(loaded.rotor, Consequence::no_trust, summary);
  const auto threshold = pages::warn_if_unstable(loaded.system, 1e-3 * speeds.back(), speeds.back(), summary);
  std::vector<shaft::Critical> criticals;  // marks of the figure
  if (shaft::returns_to_place(loaded.system, 0)) criticals = shaft::criticals(loaded.system, speeds.back());
  const Eigen::VectorXd speed = Eigen::Map<const Eigen::VectorXd>(speeds.data(), o.points);
  const std::vector<CampbellLine> lines = campbell_lines(points, o.count);
  report::Table table;
  table.caption = "whirl frequencies, Hz";
  table.columns = {{"speed", "rpm"}};
  for (std::size_t m = 0; m < lines.size(); ++m)
    table.columns.push_back({fmt::format("{} {}", m + 1, whirl_word(lines[m].direction)), "Hz"});
  const Eigen::Index every = std::max(1, (o.points - 1) / 8);
  for (Eigen::Index k = 0; k < speed.size(); k += every) {
    std::vector<std::string> row{report::format_fixed(speed[k] / kRadPerSecPerRpm, 0)};
    for (const CampbellLine& line : lines) row.push_back(report::format_fixed(line.frequency[k] / kTwoPi, 3));
    table.add(std::move(row));
  }
  session.say(report::to_text(table));
  session.result(shaft::campbell_json(points).set("unstable_from", shaft::threshold_json(threshold)));
  session.write_together();
  if (!o.out.empty()) {
    io::Table file;
    file.columns.push_back({"speed", Quantity::angular_velocity, speed});
    for (std::size_t m = 0; m < lines.size(); ++m) {
      file.columns.push_back({fmt::format("mode{}", m + 1), Quantity::frequency, lines[m].frequency / kTwoPi});
      file.columns.push_back({fmt::format("damping{}", m + 1), Quantity::dimensionless, lines[m].damping});
    }
    io::CsvWriteOptions csv;
    csv.units = {"speed_rpm"};
    io::write_csv(o.out, file, csv);
  }
  if (!o.figure.empty()) report::write_figure(campbell_figure(speed, lines, criticals, o.rotor), o.figure);
  session.finish(summary);
}

}  // namespace

void add_rotor_campbell(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorCampbellOptions>();
  CommandLine* sub = add_command(
      rotor, session, "campbell", "Whirl frequencies and damping over speed",
      "Input: a rotor file. Lines are continued by their shapes, also where they cross. --out writes speed_rpm "
      "and, of each\n"
      "mode k, modek_hz and dampingk_1.\n\n"
      "Example: whirl rotor campbell rotor.toml --to-rpm 6000 --figure campbell.svg",
      [o, &session] { rotor_campbell(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--to-rpm", o->to_rpm, "highest speed")->range(1e-3, 1e7)->required();
  sub->add_option("--points", o->points, "speeds from 0")->range(2, 10000)->show_default();
  sub->add_option("--count", o->count, "modes")->range(1, 100)->show_default();
  sub->add_option("--out", o->out, "CSV file to write")->output("table");
  sub->add_option("--figure", o->figure, "Campbell diagram (.svg, .png, .pdf, .csv)")->output();
}

}  // namespace whirl::app
