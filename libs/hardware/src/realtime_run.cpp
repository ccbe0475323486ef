#include "whirl/hardware/realtime_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "learn_tacho.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rt/realtime.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::hardware {
namespace {

constexpr std::int64_t kHidden = 20'000'000;  // ns without a look at the tacho

/// Adds one cycle; force_rms and force_y_rms hold sums of squares until the end.
void add(RealtimeRun& run, const rt::LoopSample& s) {
  ++run.samples;
  if (s.flags & rt::kValid) {
    run.x_peak = std::max(run.x_peak, std::abs(s.x));
    run.y_peak = std::max(run.y_peak, std::abs(s.y));
  } else {
    ++run.lost;
  }
  run.saturated += (s.flags & (rt::kSaturated | rt::kLimited)) != 0;
  run.force_rms += s.ux * s.ux;
  run.force_y_rms += s.uy * s.uy;
  run.force_peak = std::max({run.force_peak, std::abs(s.ux), std::abs(s.uy)});
}

/// Every cycle, trip and real-time property into the file.
class Writer {
 public:
  Writer(const RealtimeRunOptions& options, double rate) {
    note_ = options.note;
    if (!options.record.empty()) recorder_.emplace(options.record, rt::RecordingHead{1 / rate, options.texts});
  }
  void take(const rt::LoopSample& s) {
    if (!recorder_) return;
    recorder_->append(s);
    if (s.trip != trip_) recorder_->event({s.tick, s.t, "trip: " + std::string(to_string(static_cast<Fault>(s.trip)))});
    trip_ = s.trip;
    const std::uint32_t word = static_cast<std::uint32_t>(s.flags) >> rt::kSupervisionShift;
    if (word != word_) {
      recorder_->event({s.tick, s.t, "supervision: " + (word != 0 ? control::supervision_text(word) : "all well")});
    }
    word_ = word;
    if (recorder_->failure().empty() || told_) return;
    told_ = true;  // the rotor is still held: the loop goes on
    if (note_) note_(fmt::format("recording stopped at tick {}: {}; the loop runs on", s.tick, recorder_->failure()));
  }
  template <class Run>
  void finish(Run& run) {
    if (!recorder_) return;
    recorder_->close();
    run.not_recorded = recorder_->lost();
    run.record_error = recorder_->failure();
  }
  void started(const LoopOutcome& outcome) {
    if (!recorder_) return;
    for (const std::string& text : outcome.granted) recorder_->event({0, 0, "real time: " + text});
    for (const std::string& text : outcome.refused) recorder_->event({0, 0, "refused: " + text});
  }
  long rows() const { return recorder_ ? recorder_->rows() : 0; }

 private:
  std::optional<rt::LoopRecorder> recorder_;
  std::function<void(const std::string&)> note_;
  bool told_ = false;
  std::int32_t trip_ = 0;
  std::uint32_t word_ = 0;
};

/// Learns the marks of a tacho, then makes the recording: an earlier one under its name outlives a rotor that does not
/// turn. A disk that took long hid the tacho meanwhile: its marks are learned anew.
std::vector<std::string> learn_and_open(const IoSettings& io, rt::HardwareRig& rig, const RealtimeRunOptions& options,
                                        std::optional<Writer>& writer) {
  std::vector<std::string> said = learn_tacho(io, rig, options.stop);
  const rt::WallTime time;
  const std::int64_t before = time.now();
  writer.emplace(options, io.rate);
  const std::int64_t hidden = time.now() - before;
  if (!rig.tacho()) return said;
  if (hidden > kHidden) return learn_tacho(io, rig, options.stop);
  if (io.clock == "wall") rig.left_out(std::lround(1e-9 * io.rate * static_cast<double>(hidden)));
  return said;
}

LaserReport report_of(const rt::HardwareRig& rig, int i) {
  LaserReport out;
  out.late = rig.late(i);
  if (const rt::optoncdt::Sensor* laser = rig.laser(i)) {
    out.present = true;
    out.frames = laser->statistics().frames;
    out.frames_lost = laser->lost_frames();
    out.bytes_dropped = laser->statistics().dropped;
  }
  return out;
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

RealtimeRun run_realtime(const ControllerDesign& design, const IoSettings& settings,
                         const RealtimeRunOptions& options) {
  IoSettings io = settings;
  // The design knows what the rotor does without control: a loop that goes there is lost.
  if (const auto trip = design.margins.find("trip_displacement_m"); trip != design.margins.end()) {
    double& limit = io.safety.displacement;
    limit = limit > 0 ? std::min(limit, trip->second) : trip->second;
  }
  require_range("--seconds", options.seconds, 0, 1e6, "s");
  if (std::abs(design.sample_time * io.rate - 1) > 1e-6) {
    throw Error::in_file(
        io.source, 0,
        fmt::format("loop.rate_hz = {:g}: the controller was designed for {:g} Hz", io.rate, 1 / design.sample_time));
  }
  control::Controller controller = control::make_controller(design);
  if (options.require_realtime) {
    const rt::RealtimeThread trial(io.realtime);
    if (!trial.refused().empty()) throw Error("--require-rt: " + trial.refused().front());
  }
  rt::HardwareRig rig(io.hardware, io.board());
  RealtimeRun run;
  std::optional<Writer> writer;
  run.angle = learn_and_open(io, rig, options, writer);
  run.settings = io;
  run.loop = run_loop(io, rig, &controller,
                      {.seconds = options.seconds,
                       .take =
                           [&](const rt::LoopSample& s) {
                             add(run, s);
                             if (options.take) options.take(s);
                             writer->take(s);
                           },
                       .started =
                           [&](const LoopOutcome& at_start) {
                             writer->started(at_start);
                             if (options.started) options.started(at_start);
                           },
                       .control = options.control,
                       .stop = options.stop});
  writer->finish(run);
  for (double* square : {&run.force_rms, &run.force_y_rms})
    *square = run.samples > 0 ? std::sqrt(*square / static_cast<double>(run.samples)) : 0;
  for (int i = 0; i < 2; ++i) run.lasers[static_cast<std::size_t>(i)] = report_of(rig, i);
  if (const rt::TachoTracker* tacho = rig.tacho()) {
    run.tacho_missing = tacho->missing();
    run.tacho_extra = tacho->extra();
  }
  const LoopOutcome& loop = run.loop;
  if (!loop.armed) {
    run.summary.fail("not armed: " + loop.reason +
                     fmt::format(" (x {}, y {})", to_string(loop.inputs[0]), to_string(loop.inputs[1])));
  } else if (loop.trip != Fault::none && loop.trip != Fault::requested) {
    run.summary.fail("the loop tripped: " + std::string(to_string(loop.trip)));
  }
  if (const std::string failure = rig.board_failure(); !failure.empty()) run.summary.fail("board " + failure);
  return run;
}

io::Json to_json(const RealtimeRun& run) {
  const LoopOutcome& loop = run.loop;
  const rt::LoopTiming& t = loop.timing;
  io::Json json = io::start_document("whirl.realtime", 1);
  json.set("reason", loop.reason)
      .set("trip", to_string(loop.trip))
      .set("trip_tick", loop.trip_tick)
      .set("armed", loop.armed);
  json.set("clock", run.settings.clock)
      .set("rate", run.settings.rate)
      .set("dt", run.settings.dt)
      .set("overrun", run.settings.overrun);
  json.set("executed", t.executed).set("missed", t.missed).set("late_work", t.late_work).set("late_wake", t.late_wake);
  json.set("late_source", t.late_source);
  json.set("latency", histogram_json(t.latency)).set("execution", histogram_json(t.execution));
  json.set("period", histogram_json(t.period));
  json.set("samples", run.samples)
      .set("lost", run.lost)
      .set("records_dropped", static_cast<double>(loop.dropped_records))
      .set("not_recorded", run.not_recorded);
  json.set("x_peak", run.x_peak).set("y_peak", run.y_peak).set("force_rms", run.force_rms);
  json.set("force_y_rms", run.force_y_rms);
  if (!run.angle.empty()) json.set("angle", run.angle);
  if (run.tacho_missing >= 0) json.set("tacho_missing", run.tacho_missing).set("tacho_extra", run.tacho_extra);
  json.set("granted", loop.granted).set("refused", loop.refused);
  for (std::size_t i = 0; i < 2; ++i) {
    const LaserReport& seen = run.lasers[i];
    io::Json laser = io::Json::object();
    laser.set("input", to_string(loop.inputs[i])).set("late", seen.late);
    if (seen.present) {
      laser.set("frames", static_cast<double>(seen.frames)).set("frames_lost", static_cast<double>(seen.frames_lost));
      laser.set("bytes_dropped", static_cast<double>(seen.bytes_dropped));
    }
    json.set(i == 0 ? "x" : "y", laser);
  }
  return json;
}

RecordRun record_disarmed(const IoSettings& io, const RealtimeRunOptions& options) {
  require_range("--seconds", options.seconds, 0, 1e6, "s");
  rt::HardwareRig rig(io.hardware, io.board());
  RecordRun run;
  std::optional<Writer> writer;
  run.angle = learn_and_open(io, rig, options, writer);
  run.loop = run_loop(io, rig, nullptr,
                      {.seconds = options.seconds,
                       .take =
                           [&](const rt::LoopSample& s) {
                             writer->take(s);
                             if (options.take) options.take(s);
                           },
                       .started = options.started,
                       .stop = options.stop});
  writer->finish(run);
  run.cycles = writer->rows();
  if (run.cycles == 0 || run.loop.cut_short) run.summary.fail(run.loop.reason);
  if (const std::string failure = rig.board_failure(); !failure.empty()) run.summary.fail("board " + failure);
  return run;
}

io::Json to_json(const RecordRun& run) {
  io::Json json = io::start_document("whirl.record", 1);
  json.set("angle", run.angle)
      .set("cycles", run.cycles)
      .set("missed", run.loop.timing.missed)
      .set("reason", run.loop.reason);
  return json.set("records_dropped", static_cast<double>(run.loop.dropped_records))
      .set("not_recorded", run.not_recorded);
}

}  // namespace whirl::hardware
