#include "run_io.hpp"

#include <bit>
#include <cmath>
#include <optional>

#include "run_loop.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/report/table.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::app {
namespace {

constexpr double kMicro = 1e6;

/// What the sensors show of a run, x axis, zero-to-peak.
struct Seen {
  double x_peak = 0, y_peak = 0, force_square = 0, force_peak = 0;
  long samples = 0, lost = 0, saturated = 0;

  void take(const rt::LoopSample& s) {
    ++samples;
    if (s.flags & rt::kValid) {
      x_peak = std::max(x_peak, std::abs(s.x));
      y_peak = std::max(y_peak, std::abs(s.y));
    } else {
      ++lost;
    }
    saturated += (s.flags & (rt::kSaturated | rt::kLimited)) != 0;
    force_square += s.ux * s.ux;
    force_peak = std::max({force_peak, std::abs(s.ux), std::abs(s.uy)});
  }
  double force_rms() const { return samples > 0 ? std::sqrt(force_square / static_cast<double>(samples)) : 0; }
};

report::Table timing_table(const rt::LoopTiming& t) {
  report::Table table;
  table.caption = "Timing, us";
  table.columns = {{"", "", report::Align::left},
                   {"p50", ""},
                   {"p90", ""},
                   {"p99", ""},
                   {"p99.9", ""},
                   {"max", ""},
                   {"at tick", ""}};
  const auto add = [&](const char* name, const rt::Histogram& h) {
    if (h.total() == 0) return;
    std::vector<std::string> row{name};
    for (const double q : {0.5, 0.9, 0.99, 0.999}) row.push_back(fmt::format("{:.1f}", kMicro * h.quantile(q)));
    row.push_back(fmt::format("{:.1f}", kMicro * h.max()));
    row.push_back(fmt::format("{}", h.worst()));
    table.add(row);
  };
  add("wake-up latency", t.latency);
  add("execution", t.execution);
  add("period", t.period);
  return table;
}

// One line per octave that holds something.
std::string bars(const char* name, const rt::Histogram& h) {
  std::string text;
  for (int octave = 0; octave < 40 && h.total() > 0; ++octave) {
    const std::uint64_t n = h.in_octave(octave);
    if (n == 0) continue;
    const double share = static_cast<double>(n) / static_cast<double>(h.total());
    text += fmt::format("{:>10} {:>10.1f} us {:>8} {}\n", name, 1e-3 * std::ldexp(1.0, octave + 1), n,
                        std::string(static_cast<std::size_t>(std::ceil(50 * share)), '#'));
    name = "";
  }
  return text;
}

io::Json histogram_json(const rt::Histogram& h) {
  io::Json out = io::Json::object();
  out.set("p50", h.quantile(0.5))
      .set("p90", h.quantile(0.9))
      .set("p99", h.quantile(0.99))
      .set("p999", h.quantile(0.999));
  out.set("max", h.max()).set("worst_tick", h.worst());
  return out;
}

}  // namespace

void RunIoOptions::add_to(CommandLine* sub) {
  sub->add_option("--io", io,
                  "run on hardware, or on `whirl rig serve`: settings of sensors, board, loop and safety (TOML)")
      ->input();
  sub->add_option("--record", record, "with --io: HDF5 recording of every cycle; readable also after a kill")
      ->output("HDF5");
  sub->add_option("--seconds", seconds, "with --io: end after so long; 0: when the rig is done or a signal comes");
  sub->add_flag("--require-rt", require_rt, "with --io: refuse to run when the system refuses a real-time property");
}

void run_io(Session& session, const std::string& controller_file, const RunIoOptions& o,
            const ViewOptions* view_options) {
  const ControllerDesign design = io::load<ControllerDesign>(controller_file);
  const IoSettings io = read_io(o.io);
  require_range("--seconds", o.seconds, 0, 1e6, "s");
  if (std::abs(design.sample_time * io.rate - 1) > 1e-6) {
    throw Error::in_file(
        o.io, 0,
        fmt::format("loop.rate_hz = {:g}: the controller was designed for {:g} Hz", io.rate, 1 / design.sample_time));
  }
  control::Controller controller = control::make_controller(design);
  if (o.require_rt) {
    const rt::RealtimeThread trial(io.realtime);
    if (!trial.refused().empty()) throw Error("--require-rt: " + trial.refused().front());
  }
  rt::HardwareRig rig(io.hardware, io.board());
  std::optional<rt::LoopRecorder> recorder;
  if (!o.record.empty()) {
    recorder.emplace(o.record, rt::RecordingHead{1 / io.rate,
                                                 {{"controller", io::read_text(controller_file)},
                                                  {"settings", io::read_text(o.io)},
                                                  {"command_line", session.command_line}}});
  }
  std::optional<LiveView> view;
  if (view_options)
    view.emplace(*view_options, LiveView::About{design.law + " on hardware", io.rate, design.force_limit, {}});
  Seen seen;
  std::int32_t trip = 0;
  const LoopOutcome out = run_loop(
      io, rig, &controller, o.seconds,
      [&](const rt::LoopSample& s) {
        seen.take(s);
        if (view) view->take(s);
        if (!recorder) return;
        recorder->append(s);
        if (s.trip != trip)
          recorder->event({s.tick, s.t, "trip: " + std::string(to_string(static_cast<Fault>(s.trip)))});
        trip = s.trip;
      },
      [&](const LoopOutcome& at_start) {
        for (const std::string& text : at_start.granted) {
          if (recorder) recorder->event({0, 0, "real time: " + text});
        }
        for (const std::string& text : at_start.refused) {
          if (recorder) recorder->event({0, 0, "refused: " + text});
        }
        for (const std::string& text : at_start.refused) fmt::print(stderr, "whirl: real time: {}\n", text);
      },
      view ? view->control() : nullptr);
  if (view) {
    view->ended(out.reason);
    view->until_stopped();
  }

  const rt::LoopTiming& t = out.timing;
  session.say(fmt::format("{} with {}, {} clock, {:g} Hz, dt policy {}, overrun policy {}: {}", design.law,
                          design.estimator, io.clock, io.rate, io.dt, io.overrun, out.reason));
  if (out.trip != Fault::none) {
    session.say(fmt::format("safe output from tick {} on; x {}, y {}", out.trip_tick, to_string(out.inputs[0]),
                            to_string(out.inputs[1])));
  }
  session.say(fmt::format(
      "measured peak x {:.4f} mm, y {:.4f} mm (zero-to-peak); force {:.2f} N rms, {:.1f} N peak; {} of {} "
      "samples lost, {:.2f} % of ticks limited",
      1e3 * seen.x_peak, 1e3 * seen.y_peak, seen.force_rms(), seen.force_peak, seen.lost, seen.samples,
      seen.samples > 0 ? 100.0 * static_cast<double>(seen.saturated) / static_cast<double>(seen.samples) : 0));
  session.say(report::to_text(timing_table(t)));
  session.say(bars("latency", t.latency) + bars("execution", t.execution) + bars("period", t.period));
  session.say(fmt::format("{} cycles, {} ticks left out ({} times late by work, {} by wake-up); {} records dropped",
                          t.executed, t.missed, t.late_work, t.late_wake, out.dropped_records));
  for (int i = 0; i < 2; ++i) {
    if (const rt::optoncdt::Sensor* laser = rig.laser(i)) {
      session.say(fmt::format("laser {}: {} frames, {} lost, {} bytes dropped, {} ticks without a new sample",
                              i == 0 ? "x" : "y", laser->statistics().frames, laser->lost_frames(),
                              laser->statistics().dropped, rig.late(i)));
    }
  }

  io::Json json = io::start_document("whirl.realtime", 1);
  json.set("reason", out.reason)
      .set("trip", to_string(out.trip))
      .set("trip_tick", out.trip_tick)
      .set("armed", out.armed);
  json.set("clock", io.clock).set("rate", io.rate).set("dt", io.dt).set("overrun", io.overrun);
  json.set("executed", t.executed).set("missed", t.missed).set("late_work", t.late_work).set("late_wake", t.late_wake);
  json.set("latency", histogram_json(t.latency)).set("execution", histogram_json(t.execution));
  json.set("period", histogram_json(t.period));
  json.set("samples", seen.samples)
      .set("lost", seen.lost)
      .set("records_dropped", static_cast<double>(out.dropped_records));
  json.set("x_peak", seen.x_peak).set("y_peak", seen.y_peak).set("force_rms", seen.force_rms());
  json.set("granted", out.granted).set("refused", out.refused);
  for (int i = 0; i < 2; ++i) {
    io::Json laser = io::Json::object();
    laser.set("input", to_string(out.inputs[static_cast<std::size_t>(i)])).set("late", rig.late(i));
    if (const rt::optoncdt::Sensor* s = rig.laser(i)) {
      laser.set("frames", static_cast<double>(s->statistics().frames))
          .set("frames_lost", static_cast<double>(s->lost_frames()));
      laser.set("bytes_dropped", static_cast<double>(s->statistics().dropped));
    }
    json.set(i == 0 ? "x" : "y", laser);
  }
  session.result(json);
  Summary summary;
  if (!out.armed)
    summary.fail("not armed: " + out.reason +
                 fmt::format(" (x {}, y {})", to_string(out.inputs[0]), to_string(out.inputs[1])));
  else if (out.trip != Fault::none && out.trip != Fault::requested)
    summary.fail("the loop tripped: " + std::string(to_string(out.trip)));
  session.finish(summary);
}

}  // namespace whirl::app
