#include "rig_campbell.hpp"

#include <numbers>

#include "whirl/io/csv.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/rig/tilt.hpp"

namespace whirl::app {
namespace {

struct CampbellOptions {
  std::string rig, out;
  int points = 9;
};

void campbell(const CampbellOptions& o, Session& session) {
  constexpr double kTurn = 2 * std::numbers::pi;
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
    std::vector<std::string> row{report::format_fixed(omega * 60 / kTurn, 0)};
    file.columns[0].samples[i] = omega;
    for (Eigen::Index k = 0; k < 4; ++k) {
      const double hz = std::abs(poles[k].imag()) / kTurn;
      row.push_back(report::format_fixed(hz, 3));
      file.columns[static_cast<std::size_t>(k) + 1].samples[i] = hz;
    }
    table.add(std::move(row));
  }
  session.say(report::to_text(table));
  io::Json critical = io::Json::array();
  std::string text;
  for (const double speed : rotor::critical_speeds(rotor)) {
    text += fmt::format("{}{:.1f} rpm", text.empty() ? "" : ", ", speed * 60 / kTurn);
    critical.push(speed);
  }
  session.say("critical speeds of the unbalance: " + text);
  session.result(io::Json::object().set("critical_speeds_rad_s", std::move(critical)));
  if (!o.out.empty()) {
    io::CsvWriteOptions csv;
    csv.units = {"speed_rpm"};
    io::write_csv(o.out, file, csv);
  }
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
                  "Example: whirl rig campbell --rig examples/07_gyroscopic/rig.toml",
                  [o, &session] { campbell(*o, session); });
  sub->add_option("--rig", o->rig, "TOML file of `whirl rig parameters`")->input()->required();
  sub->add_option("--points", o->points, "speeds from 0 to the top");
  sub->add_option("--out", o->out, "CSV file to write")->output("table");
}

}  // namespace whirl::app
