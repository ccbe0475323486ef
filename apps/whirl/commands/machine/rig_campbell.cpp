#include "rig_campbell.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "whirl/core/angles.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/report/units.hpp"
#include "whirl/report/write_figure.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/rig/tilt.hpp"

namespace whirl::app {
namespace {

struct CampbellOptions {
  std::string rig, out, figure;
  int points = 9;
};

/// Frequencies of `file` over its speed, the running speed (1X), and the speeds at which they meet.
report::Figure diagram(const io::Table& file, const std::vector<double>& critical, const std::string& rig) {
  report::Figure figure;
  figure.title = "Campbell diagram";
  figure.description = "Frequencies of free whirl over rotor speed, with the running speed.";
  report::Panel& panel = figure.panel("", {"rotor speed", report::kRpm}, {"frequency", report::kHertz});
  panel.height = 340;
  const Eigen::VectorXd& speed = file.columns[0].samples;
  const std::pair<const char*, report::Style> branches[] = {
      {"backward, tilt", {.color = 1, .dash = report::Dash::dashed}},
      {"backward", {.color = 0, .dash = report::Dash::dashed}},
      {"forward", {.color = 0}},
      {"forward, tilt", {.color = 1}}};
  for (std::size_t k = 0; k < std::size(branches); ++k)
    panel.line(branches[k].first, speed, file.columns[k + 1].samples, branches[k].second);
  panel.line("1X", speed, speed / kTwoPi, {.color = 7, .dash = report::Dash::dotted});
  Eigen::VectorXd at(static_cast<Eigen::Index>(critical.size()));
  std::string list;
  for (std::size_t k = 0; k < critical.size(); ++k) {
    at[static_cast<Eigen::Index>(k)] = critical[k];
    list += fmt::format("{}{:.0f}", k > 0 ? ", " : "", critical[k] / report::kRpm.factor);
  }
  if (at.size() > 0) panel.scatter("critical speed of the unbalance: " + list + " rpm", at, at / kTwoPi, {.color = 6});
  panel.y.low = 0;
  figure.runs = {std::filesystem::path(rig).filename().string()};
  return figure;
}

void campbell(const CampbellOptions& o, Session& session) {
  require_range("--points", o.points, 2, 100000);
  const rig::RigParameters p = rig::read_rig(o.rig);
  const rotor::GyroscopicRotor rotor = rig::gyroscopic_rotor(p);
  const double top = std::max(p.profile.omega_start, p.profile.omega_end);
  report::Table table;
  table.caption = "whirl frequencies, Hz";
  table.columns = {
      {"speed", "rpm"}, {"backward, tilt", "Hz"}, {"backward", "Hz"}, {"forward", "Hz"}, {"forward, tilt", "Hz"}};
  io::Table file;
  for (const char* name : {"backward_tilt", "backward", "forward", "forward_tilt"}) {
    file.columns.push_back({name, Quantity::frequency, Eigen::VectorXd(o.points)});
  }
  file.columns.insert(file.columns.begin(), {"speed", Quantity::angular_velocity, Eigen::VectorXd(o.points)});
  for (int i = 0; i < o.points; ++i) {
    const double omega = top * i / (o.points - 1);
    const Eigen::Vector4cd poles = rotor::whirl_poles(rotor, omega);  // by frequency, backward negative
    std::vector<std::string> row{report::format_fixed(omega * 60 / kTwoPi, 0)};
    file.columns[0].samples[i] = omega;
    for (Eigen::Index k = 0; k < 4; ++k) {
      const double hz = std::abs(poles[k].imag()) / kTwoPi;
      row.push_back(report::format_fixed(hz, 3));
      file.columns[static_cast<std::size_t>(k) + 1].samples[i] = hz;
    }
    table.add(std::move(row));
  }
  session.say(report::to_text(table));
  io::Json critical = io::Json::array();
  std::string text;
  const std::vector<double> crossings = rotor::critical_speeds(rotor);
  for (const double speed : crossings) {
    text += fmt::format("{}{:.1f} rpm", text.empty() ? "" : ", ", speed * 60 / kTwoPi);
    critical.push(speed);
  }
  session.say("critical speeds of the unbalance: " + text);
  session.result(io::Json::object().set("critical_speeds_rad_s", std::move(critical)));
  session.write_together();
  if (!o.out.empty()) {
    io::CsvWriteOptions csv;
    csv.units = {"speed_rpm"};
    io::write_csv(o.out, file, csv);
  }
  if (!o.figure.empty()) report::write_figure(diagram(file, crossings, o.rig), o.figure);
}

}  // namespace

void add_rig_campbell(CommandLine& rig, Session& session) {
  auto o = std::make_shared<CampbellOptions>();
  CommandLine* sub =
      add_command(rig, session, "campbell", "Whirl frequencies and critical speeds of a rotor that tilts",
                  "For a rig with a table [tilt] (gyroscopic rotor with four degrees of freedom): the "
                  "frequencies of free whirl, forward\n"
                  "and backward, from standstill to the top speed of its profile. --out writes them as CSV "
                  "with speed_rpm, backward_tilt_hz,\n"
                  "backward_hz, forward_hz, forward_tilt_hz.\n\n"
                  "Example: whirl rig campbell --rig examples/07_gyroscopic/rig.toml --figure campbell.svg",
                  [o, &session] { campbell(*o, session); });
  sub->add_option("--rig", o->rig, "TOML file of `whirl rig parameters`")->input()->required();
  sub->add_option("--points", o->points, "speeds from 0 to the top")->range(2, 100000);
  sub->add_option("--out", o->out, "CSV file to write")->output("table");
  sub->add_option("--figure", o->figure, "Campbell diagram (.svg, .png, .pdf, .csv)")->output();
}

}  // namespace whirl::app
