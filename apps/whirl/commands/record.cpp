#include <array>
#include <cmath>
#include <optional>

#include "run_io.hpp"
#include "run_loop.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::app {
namespace {

/// Replayed and recorded side by side, for --out.
constexpr std::array<std::pair<const char*, Quantity>, 16> kColumns{{{"x", Quantity::displacement},
                                                                     {"y", Quantity::displacement},
                                                                     {"beta", Quantity::angle},
                                                                     {"omega", Quantity::angular_velocity},
                                                                     {"ux_recorded", Quantity::force},
                                                                     {"uy_recorded", Quantity::force},
                                                                     {"ux", Quantity::force},
                                                                     {"uy", Quantity::force},
                                                                     {"x_est", Quantity::displacement},
                                                                     {"y_est", Quantity::displacement},
                                                                     {"vx_est", Quantity::velocity},
                                                                     {"vy_est", Quantity::velocity},
                                                                     {"s_x", Quantity::velocity},
                                                                     {"s_y", Quantity::velocity},
                                                                     {"valid", Quantity::dimensionless},
                                                                     {"missed", Quantity::dimensionless}}};

ControllerDesign design_for(const rt::LoopRecord& record, const std::string& file) {
  if (!file.empty()) return io::load<ControllerDesign>(file);
  const std::string* text = record.text("controller");
  if (!text) throw Error("the recording holds no controller: give one with --controller");
  return io::from_json<ControllerDesign>(io::parse_json(*text, "controller of the recording"),
                                         "controller of the recording");
}

void replay(Session& session, const std::string& file, const std::string& controller_file, const std::string& estimator,
            const std::string& out) {
  const rt::LoopRecord record = rt::read_loop_record(file);
  session.say(fmt::format("{}: {} cycles at {:g} Hz{}", file, record.cycles.size(), 1 / record.head.sample_time,
                          record.closed ? "" : "; its writer was killed"));
  for (const rt::LoopEvent& e : record.events) session.say(fmt::format("  tick {}: {}", e.tick, e.text));
  if (record.cycles.empty()) throw Error::in_file(file, 0, "no cycles");
  ControllerDesign design = design_for(record, controller_file);
  if (!estimator.empty() && estimator != design.estimator) {
    for (const control::ParameterInfo& p : control::estimator_info(design.estimator).parameters)
      design.parameters.erase(p.name);
    design.estimator = estimator;
  }
  control::Controller controller = control::make_controller(design);
  Eigen::MatrixXd table(static_cast<Eigen::Index>(record.cycles.size()), static_cast<Eigen::Index>(kColumns.size()));
  double square = 0, worst = 0;
  long compared = 0;
  for (std::size_t k = 0; k < record.cycles.size(); ++k) {
    const rt::LoopSample& s = record.cycles[k];
    const Measurement m{s.t, s.x, s.y, s.beta, s.omega, s.omega_dot, (s.flags & rt::kValid) != 0};
    Command u;
    if (const auto request = controller.step(m)) u = *request;
    // What the loop really sent is what the plant answered to.
    controller.applied({s.ux, s.uy});
    const control::ControllerState& c = controller.state();
    if ((s.flags & rt::kArmed) && !(s.flags & rt::kLimited) && s.trip == 0) {
      const double d = std::hypot(u.ux - s.ux, u.uy - s.uy);
      square += d * d;
      worst = std::max(worst, d);
      ++compared;
    }
    table.row(static_cast<Eigen::Index>(k)) << s.x, s.y, s.beta, s.omega, s.ux, s.uy, u.ux, u.uy, c.estimate.z.real(),
        c.estimate.z.imag(), c.estimate.v.real(), c.estimate.v.imag(), c.s.real(), c.s.imag(), m.valid ? 1.0 : 0.0,
        s.missed;
  }
  const double rms = compared > 0 ? std::sqrt(square / static_cast<double>(compared)) : 0;
  session.say(
      fmt::format("{} with {}: force differs from the recorded one by {:.3g} N rms, {:.3g} N at most, over {} cycles",
                  design.law, design.estimator, rms, worst, compared));
  if (!out.empty()) {
    Recording log;
    log.dt = record.head.sample_time;
    log.t0 = record.cycles.front().t;
    log.source = file;
    for (std::size_t c = 0; c < kColumns.size(); ++c) {
      log.add(kColumns[c].first, kColumns[c].second, table.col(static_cast<Eigen::Index>(c)));
    }
    io::write_csv(out, log);
  }
  io::Json json = io::start_document("whirl.replay", 1);
  json.set("cycles", static_cast<double>(record.cycles.size())).set("closed", record.closed);
  json.set("compared", compared).set("force_difference_rms", rms).set("force_difference_max", worst);
  session.result(json);
}

}  // namespace

void add_record(CommandLine& app, Session& session) {
  struct Options {
    std::string io, out;
    double seconds = 0;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "record", "Record sensors and rotor angle without control",
      "Input: io.toml (docs/formats.md). Output: HDF5 with one row per tick (dataset `cycles`, SI) and events; it can "
      "be read\n"
      "at any time, also after a kill, and lacks half a second at most. Ends after --seconds, with the rig, or on "
      "Ctrl-C.\n\n"
      "Example: whirl record --io io.toml --seconds 20 --out rundown.h5 && whirl replay rundown.h5 --controller c.json",
      [o, &session] {
        const IoSettings io = read_io(o->io);
        require_range("--seconds", o->seconds, 0, 1e6, "s");
        rt::HardwareRig rig(io.hardware, io.board());
        rt::LoopRecorder recorder(
            o->out, {1 / io.rate, {{"settings", io::read_text(o->io)}, {"command_line", session.command_line}}});
        const LoopOutcome out =
            run_loop(io, rig, nullptr, o->seconds, [&](const rt::LoopSample& s) { recorder.append(s); });
        session.say(fmt::format("{}: {} cycles, {} ticks left out, {} records dropped; {}", o->out, recorder.rows(),
                                out.timing.missed, out.dropped_records, out.reason));
        io::Json json = io::start_document("whirl.record", 1);
        json.set("cycles", recorder.rows()).set("missed", out.timing.missed).set("reason", out.reason);
        json.set("records_dropped", static_cast<double>(out.dropped_records));
        session.result(json);
        Summary summary;
        if (recorder.rows() == 0) summary.fail(out.reason);
        session.finish(summary);
      });
  sub->add_option("--io", o->io, "settings of sensors, board and loop (TOML)")->input()->required();
  sub->add_option("--out", o->out, "recording to write (.h5)")->output("HDF5")->required();
  sub->add_option("--seconds", o->seconds, "end after so long; 0: when the rig is done or a signal comes");
}

void add_replay(CommandLine& app, Session& session) {
  struct Options {
    std::string file, controller, estimator, out;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub =
      add_command(app, session, "replay", "A recording of a loop through a controller or estimator",
                  "Input: recording of `whirl run --record` or `whirl record`. The controller (default: the one "
                  "recorded) gets the\n"
                  "recorded samples and the forces that were really sent; --estimator replaces its estimator.\n"
                  "Output: difference to the recorded force; --out writes both, the estimates and the sliding "
                  "variables as CSV (SI).\n\n"
                  "Example: whirl replay run.h5 --estimator kalman --out replay.csv",
                  [o, &session] { replay(session, o->file, o->controller, o->estimator, o->out); });
  sub->add_option("RECORDING", o->file, "recording (.h5)")->input()->required();
  sub->add_option("--controller", o->controller, "controller.json")->input();
  sub->add_option("--estimator", o->estimator, "estimator; `whirl design --list` names all");
  sub->add_option("--out", o->out, "CSV file to write")->output("record");
}

}  // namespace whirl::app
