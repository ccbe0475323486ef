#include <fmt/format.h>

#include <cmath>

#include "rotor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/pages/rotor_runs.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/shaft/centrifuge/centrifuge_json.hpp"

namespace whirl::app {
namespace {

struct CentrifugeCheckOptions {
  std::string rotor, record;
  std::vector<std::string> sensors;
  double to_rpm = 0;
};

std::string grams(const Estimate& e) {
  return fmt::format("{} g ({} to {})", report::format_fixed(1e3 * e.value, 2), report::format_fixed(1e3 * e.low, 2),
                     report::format_fixed(1e3 * e.high, 2));
}

void say_check(const shaft::LoadCheck& c, const shaft::CentrifugeSetup& setup, Session& session) {
  const char* verdict = c.verdict == shaft::LoadVerdict::right   ? "loaded right"
                        : c.verdict == shaft::LoadVerdict::wrong ? "loaded wrong"
                                                                 : "open";
  session.say(fmt::format("loading            {}: above the allowed {} g with a probability of {:.3g}", verdict,
                          report::format_number(1e3 * setup.allowed, 3), c.wrong_probability));
  session.say(fmt::format("imbalance          {} at {:.4g} mm, 95 %", grams(c.imbalance), 1e3 * setup.radius));
  if (c.angle.high - c.angle.low > kPi)
    session.say("heavy side         not known");
  else
    session.say(fmt::format("heavy side         {:.1f} deg from the mark ({:.1f} to {:.1f})",
                            c.angle.value / kRadPerDegree, c.angle.low / kRadPerDegree, c.angle.high / kRadPerDegree));
  std::string named;
  for (const int bucket : c.named) named += fmt::format("{}{}", named.empty() ? "" : " and ", bucket);
  session.say("bucket             " + (named.empty()         ? "not known"
                                       : c.named.size() == 1 ? named + ", nearest to the heavy side"
                                                             : named + ", on both sides of the heavy one"));
  for (const shaft::BucketChange& b : c.changes)
    session.say(fmt::format("  bucket {:<9} too heavy by {} against the one opposite", b.bucket, grams(b.mass)));
  session.say(fmt::format("decided            at {:.0f} rpm after {:.0f} s; first critical speed {:.0f} rpm",
                          c.decided_at * kRpmPerRadPerSec, c.seconds, c.first_critical * kRpmPerRadPerSec));
  // The tail of a distribution of 300 machines says nothing of smaller rates.
  const std::string miss = c.miss_rate < 1e-3 ? "less than 0.1" : fmt::format("{:.2g}", 100 * c.miss_rate);
  const std::string found = std::isfinite(c.smallest_found)
                                ? report::format_number(1e3 * c.smallest_found, 3) + " g in 95 of 100"
                                : "no imbalance, however large: smaller tolerances are needed";
  session.say(fmt::format("such a record      false alarm at most {:.0f} %; finds {}; misses twice the allowed in {} %",
                          100 * (1 - shaft::kWrongProbability), found, miss));
  if (c.verdict != shaft::LoadVerdict::open) return;
  session.say(std::isfinite(c.seconds_more)
                  ? fmt::format("to decide          {:.0f} s more at the last speed", c.seconds_more)
                  : "to decide          smaller tolerances are needed: more time does not help");
}

void centrifuge_check(const CentrifugeCheckOptions& o, Session& session) {
  const shaft::RotorJob job = shaft::read_rotor_job(o.rotor);
  const pages::SensorRun spinup = pages::sensor_run(io::read_recording(o.record, {}), job, o.sensors);
  const shaft::LoadCheck check = shaft::check_load(job.rotor, job.centrifuge, spinup.run, spinup.sensors,
                                                   {.highest = o.to_rpm * kRadPerSecPerRpm});
  say_check(check, job.centrifuge, session);
  session.result(shaft::load_check_json(check));
  session.finish(check.summary);
}

struct CentrifugeLimitsOptions {
  std::string rotor, out;
  double from_rpm = 60, to_rpm = 0, safety = 2;
  int points = 200;
};

void centrifuge_limits(const CentrifugeLimitsOptions& o, Session& session) {
  const shaft::RotorJob job = shaft::read_rotor_job(o.rotor);
  if (!(o.to_rpm > o.from_rpm)) throw Error::in_field("--to-rpm", fmt::format("{:g}", o.to_rpm), "above --from-rpm");
  std::vector<double> speeds;
  for (int k = 0; k < o.points; ++k)
    speeds.push_back((o.from_rpm + (o.to_rpm - o.from_rpm) * k / (o.points - 1)) * kRadPerSecPerRpm);
  const shaft::SpeedLimits limits = shaft::speed_limits(job.rotor, job.centrifuge, speeds, o.safety);
  for (const double critical : limits.criticals)
    session.say(fmt::format("critical speed     {:.0f} rpm, forward", critical * kRpmPerRadPerSec));
  report::Table table;
  table.caption = fmt::format("limits, zero-to-peak; expected with {:.3g} g, trip at {:.3g} times that",
                              1e3 * job.centrifuge.allowed, o.safety);
  table.columns = {{"speed", "rpm"}};
  for (const shaft::CentrifugeSensor& s : limits.sensors) {
    table.columns.push_back({s.name + ", expected", s.accelerometer ? "m/s^2" : "um"});
    table.columns.push_back({s.name + ", trip", s.accelerometer ? "m/s^2" : "um"});
  }
  table.columns.push_back({"trips from", "g"});
  constexpr int kShown = 16;
  for (int row = 0; row < kShown; ++row) {
    const Eigen::Index k = static_cast<Eigen::Index>(row) * (o.points - 1) / (kShown - 1);
    std::vector<std::string> cells{report::format_fixed(speeds[static_cast<std::size_t>(k)] * kRpmPerRadPerSec, 0)};
    for (Eigen::Index s = 0; s < limits.trip.rows(); ++s)
      for (const auto* m : {&limits.expected, &limits.trip})
        cells.push_back(report::format_number(
            (limits.sensors[static_cast<std::size_t>(s)].accelerometer ? 1 : 1e6) * (*m)(s, k), 3));
    cells.push_back(report::format_number(1e3 * limits.caught[k], 3));
    table.add(cells);
  }
  session.say(report::to_text(table));
  session.result(shaft::speed_limits_json(limits));
  if (o.out.empty()) return;
  io::Table file;
  io::CsvWriteOptions csv;
  csv.units = {"speed_rpm"};
  file.columns.push_back(
      {"speed", Quantity::angular_velocity, Eigen::Map<const Eigen::VectorXd>(speeds.data(), o.points)});
  for (std::size_t s = 0; s < limits.sensors.size(); ++s) {
    const std::string name = pages::column_name(limits.sensors[s].name);
    const bool acceleration = limits.sensors[s].accelerometer;
    const auto row = static_cast<Eigen::Index>(s);
    const Quantity quantity = acceleration ? Quantity::acceleration : Quantity::displacement;
    file.columns.push_back({name + "_expected", quantity, limits.expected.row(row).transpose()});
    file.columns.push_back({name + "_trip", quantity, limits.trip.row(row).transpose()});
    csv.units.push_back(name + "_expected_" + (acceleration ? "m_s2" : "um"));
    csv.units.push_back(name + "_trip_" + (acceleration ? "m_s2" : "um"));
  }
  file.columns.push_back({"trips_from", Quantity::mass, limits.caught});
  csv.units.push_back("trips_from_gram");
  io::write_csv(o.out, file, csv);
}

void add_check(CommandLine& centrifuge, Session& session) {
  auto o = std::make_shared<CentrifugeCheckOptions>();
  CommandLine* sub = add_command(
      centrifuge, session, "check", "Is it loaded right? Imbalance at spin-up, before the first critical speed",
      "Input: a rotor file with [centrifuge] and an [[accelerometer]] on a body or a [[probe]], and a record of a "
      "spin-up with a\n"
      "channel of that name and key, tacho or beta. Used up to half the first critical speed of the model. Printed: "
      "imbalance and\n"
      "angle with intervals that hold for every machine within the tolerances of the file, the bucket to change and by "
      "how much,\n"
      "false-alarm and miss rate, and where it is open how much longer to spin.\n\n"
      "Example: whirl centrifuge check rotor.toml spinup.csv",
      [o, &session] { centrifuge_check(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("RECORD", o->record, "record of the spin-up")->input()->required();
  sub->add_option("--sensor", o->sensors, "sensor to use; may be repeated (all that the record has)");
  sub->add_option("--to-rpm", o->to_rpm, "use speeds up to this (half the first critical speed)")->range(1e-3, 1e7);
}

void add_limits(CommandLine& centrifuge, Session& session) {
  auto o = std::make_shared<CentrifugeLimitsOptions>();
  CommandLine* sub = add_command(
      centrifuge, session, "limits", "Trip where? Limits of every sensor over speed from the model",
      "Input: a rotor file with [centrifuge]. A sensor trips at the amplitude that 99 of 100 machines within the "
      "tolerances stay\n"
      "below with --safety times the allowed imbalance. The last column is the imbalance from which one sensor trips "
      "in 99 "
      "of 100\n"
      "machines. --out writes speed_rpm and, of each sensor, NAME_expected and NAME_trip (zero-to-peak).\n\n"
      "Example: whirl centrifuge limits rotor.toml --to-rpm 3000 --out limits.csv",
      [o, &session] { centrifuge_limits(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--from-rpm", o->from_rpm, "lowest speed")->range(1e-3, 1e7)->show_default();
  sub->add_option("--to-rpm", o->to_rpm, "highest speed")->range(1e-3, 1e7)->required();
  sub->add_option("--safety", o->safety, "imbalance at the limit in parts of the allowed one")
      ->range(1, 1000)
      ->show_default();
  sub->add_option("--points", o->points, "speeds")->range(16, 100000)->show_default();
  sub->add_option("--out", o->out, "CSV file to write")->output("table");
}

}  // namespace

void add_centrifuge(CommandLine& app, Session& session) {
  CommandLine* centrifuge =
      app.add_subcommand("centrifuge", "Centrifuges: loading at spin-up, limits over speed, run-up, from a rotor file");
  centrifuge->require_subcommand();
  centrifuge->footer(
      "The rotor file (whirl rotor new --template centrifuge) says what the machine is and how well that is known "
      "(docs/rotor.md).\n\n"
      "Example: whirl rotor new --template centrifuge --out rotor.toml && whirl centrifuge limits rotor.toml --to-rpm "
      "3000");
  add_check(*centrifuge, session);
  add_limits(*centrifuge, session);
  add_centrifuge_runup(*centrifuge, session);
}

}  // namespace whirl::app
