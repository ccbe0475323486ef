#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

#include "commands/balance/response.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/identify/drive.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/identify/parts/readings.hpp"
#include "whirl/identify/record/model_run.hpp"
#include "whirl/identify/tilt/tilt_rotor.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/report/format.hpp"

namespace whirl::app {
namespace {

using Eigen::Index;

struct SimulateOptions {
  std::string model, record, out;
  double from_rpm = 0, to_rpm = 0, seconds = 0, dwell_s = 0, rate_hz = 1000, unbalance = 1, eccentricity_um = -1,
         phase_deg = 0, drive = 0, limit_rpm = 0;
};

Channel channel(std::string name, Eigen::VectorXd samples, Quantity quantity) {
  Channel c;
  c.name = std::move(name);
  c.samples = std::move(samples);
  c.quantity = quantity;
  return c;
}

/// A model without rotor parameters: free run over the inputs of a record.
Recording run_equations(const IdentifiedModel& model, const SimulateOptions& o) {
  if (o.record.empty()) throw Error("a model without rotor parameters needs --record: a file with its inputs");
  return identification::run_over_record(model, io::read_recording(o.record));
}

/// A rotor over the speed profile asked for.
Recording run_rotor(const IdentifiedModel& model, const SimulateOptions& o, double& peak, double& at) {
  if (o.from_rpm == o.to_rpm && o.seconds == 0)
    throw Error("give --from-rpm, --to-rpm and --seconds for a run-up or run-down, or --record for its inputs");
  if (o.seconds == 0) throw Error("--seconds is missing: the length of the run-up or run-down");
  identification::SpeedRun run;
  run.from = o.from_rpm * kRadPerSecPerRpm;
  run.to = o.to_rpm * kRadPerSecPerRpm;
  run.seconds = o.seconds;
  run.dwell = o.dwell_s;
  run.rate = o.rate_hz;
  run.unbalance = o.unbalance;
  if (o.eccentricity_um >= 0) run.eccentricity = std::polar(o.eccentricity_um * 1e-6, o.phase_deg * kRadPerDegree);
  identification::SpeedRunMotion motion = identification::run_over_speeds(model, run);
  peak = motion.peak;
  at = motion.speed;
  return std::move(motion.record);
}

/// The smallest and the largest of the peaks by every reading of the records.
std::pair<double, double> peaks_of_readings(const IdentifiedModel& model, const SimulateOptions& o, double own,
                                            Summary& summary) {
  std::pair<double, double> range{own, own};
  for (const identification::ModelReading& reading : identification::other_readings(model, true)) {
    double peak = 0, at = 0;
    if (const Estimate* bow = reading.model.parameter("bow")) {
      // The shaft moves as the probe reads: the motion of the reading as runout, and the bow beside it.
      const Estimate* phase = reading.model.parameter("bow_phase");
      const std::complex<double> bent = std::polar(bow->value, phase != nullptr ? phase->value : 0.0);
      const Recording run = run_rotor(model, o, peak, at);
      peak = 0;
      for (Index i = 0; i < run.size(); ++i) {
        const std::complex<double> z(run["x"][i], run["y"][i]);
        peak = std::max(peak, std::abs(z - model.rotor->offset + bent * std::polar(1.0, run["beta"][i])));
      }
    } else {
      try {
        run_rotor(reading.model, o, peak, at);
      } catch (const Error&) {  // its motion diverges
        summary.add({FindingCode::readings_differ, Consequence::warning, {}, reading.reading},
                    ": its motion diverges over this profile");
        continue;
      }
    }
    range = {std::min(range.first, peak), std::max(range.second, peak)};
  }
  return range;
}

/// A run from rest at one level of the drive; --limit-rpm: the least level that gets there.
void run_drive(const IdentifiedModel& model, const SimulateOptions& o, Session& session) {
  require_range("--seconds", o.seconds, 1e-6, 1e6, "s");
  const identification::RunUp up = identification::run_up(model, o.drive, o.seconds, o.rate_hz);
  const double critical = model.rotor ? model.rotor->natural_frequency() : 0;
  const bool stalls = critical > 0 && up.reached < critical && up.reached > 0.8 * critical;
  io::Json json = io::Json::object();
  json.set("reached_rad_s", up.reached).set("critical_rad_s", critical).set("stalls", stalls);
  session.say(fmt::format(
      "drive {:g}           {:.0f} rpm after {:g} s{}", o.drive, up.reached / kRadPerSecPerRpm, o.seconds,
      stalls ? fmt::format(": stalls below the critical speed of {:.0f} rpm", critical / kRadPerSecPerRpm) : ""));
  if (o.limit_rpm > 0) {
    const double least = identification::limiting_drive(model, o.limit_rpm * kRadPerSecPerRpm, o.seconds, o.rate_hz,
                                                        100 * std::max(std::abs(o.drive), 1e-6));
    json.set("limiting_drive", least);
    session.say(
        fmt::format("limiting drive     {:.5g} to pass {:.0f} rpm within {:g} s", least, o.limit_rpm, o.seconds));
  }
  if (!o.out.empty()) {
    Recording out;
    out.dt = 1 / o.rate_hz;
    out.channels.push_back(channel("speed", up.speed, Quantity::angular_velocity));
    out.channels.push_back(channel("radius", up.radius, Quantity::displacement));
    io::write_csv(o.out, out);
  }
  session.result(json);
  session.finish(model.summary);
}

void run(const SimulateOptions& o, Session& session) {
  const IdentifiedModel model = io::load<IdentifiedModel>(o.model);
  if (o.drive != 0) return run_drive(model, o, session);
  if (o.limit_rpm > 0) throw Error("--limit-rpm needs --drive");
  Summary summary = model.summary;
  identification::take_parts(identification::Consumer::simulate, model, summary, o.model);
  double peak = 0, at = 0;
  std::pair<double, double> readings;
  Recording result;
  if ((model.rotor || identification::has_tilt(model)) && o.record.empty()) {
    result = run_rotor(model, o, peak, at);
    session.say(fmt::format("largest radius     {} at {:.0f} rpm", report::format_amplitude(peak, AmplitudeKind::peak),
                            at / kRadPerSecPerRpm));
    if (!identification::has_tilt(model)) readings = peaks_of_readings(model, o, peak, summary);
    if (readings.second > readings.first)
      session.say(fmt::format("all readings       {} to {}",
                              report::format_amplitude(readings.first, AmplitudeKind::peak),
                              report::format_amplitude(readings.second, AmplitudeKind::peak)));
  } else {
    if (o.seconds > 0 || o.unbalance != 1 || o.eccentricity_um >= 0)
      throw Error("--seconds, --unbalance and --eccentricity-um belong to a rotor's speed profile, not to --record");
    result = run_equations(model, o);
  }
  if (!o.out.empty()) io::write_csv(o.out, result);
  io::Json json = io::Json::object();
  json.set("samples", static_cast<double>(result.size())).set("dt", result.dt);
  if (peak > 0) json.set("peak_radius_m", peak).set("peak_omega", at);
  if (readings.second > readings.first)
    json.set("peak_radius_readings_m", io::Json::array().push(readings.first).push(readings.second));
  session.say(fmt::format("samples            {} at {:g} Hz{}", result.size(), 1 / result.dt,
                          o.out.empty() ? "" : ", written to " + o.out));
  if (const auto range = identification::load_data_range(o.model); range && o.record.empty() && peak > 0) {
    if (const std::string text = range->beyond(peak, o.from_rpm * kRadPerSecPerRpm, o.to_rpm * kRadPerSecPerRpm);
        !text.empty())
      summary.warn(text);
  }
  session.result(json.set("summary", to_json(summary)));
  session.finish(summary);
}

}  // namespace

void add_simulate(CommandLine& app, Session& session) {
  auto o = std::make_shared<SimulateOptions>();
  CommandLine* sub =
      add_command(app, session, "simulate", "Motion of a model over a run-up, a run-down or a record's inputs",
                  "Input: model.json of `whirl identify`. A rotor runs from one speed to another (up or down) from its "
                  "steady whirl;\n"
                  "a model of other equations runs over the inputs in the record --record, from its first sample.\n\n"
                  "Example: whirl simulate model.json --from-rpm 300 --to-rpm 2000 --seconds 10 --out runup.csv",
                  [o, &session] { run(*o, session); });
  sub->add_option("MODEL", o->model, "model.json")->input()->required();
  sub->add_option("--from-rpm", o->from_rpm, "speed at the start")->range(0.0, 1e6);
  sub->add_option("--to-rpm", o->to_rpm, "speed at the end of the ramp")->range(0.0, 1e6);
  sub->add_option("--seconds", o->seconds, "length of the ramp")->range(0, 1e6);
  sub->add_option("--dwell-s", o->dwell_s, "time at the last speed")->range(0, 1e6)->show_default();
  sub->add_option("--rate-hz", o->rate_hz, "samples a second")->range(1, 1e7)->show_default();
  sub->add_option("--unbalance", o->unbalance, "times the identified eccentricity")->range(-1e3, 1e3)->show_default();
  sub->add_option("--eccentricity-um", o->eccentricity_um, "instead of the identified one")->range(0, 1e6);
  sub->add_option("--phase-deg", o->phase_deg, "its angle")->range(-360, 360)->show_default();
  sub->add_option("--record", o->record, "CSV with the inputs of a model of other equations, or with the drive")
      ->input();
  sub->add_option("--drive", o->drive, "model of `identify --drive`: run from rest at this level of the drive");
  sub->add_option("--limit-rpm", o->limit_rpm, "with --drive: the least level that passes this speed in --seconds")
      ->range(0.0, 1e6);
  sub->add_option("--out", o->out, "the record, CSV")->output("record");
}

}  // namespace whirl::app
