#include "whirl/hardware/survey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "learn_tacho.hpp"
#include "whirl/core/error.hpp"
#include "whirl/hardware/at_rest.hpp"
#include "whirl/rt/realtime.hpp"

namespace whirl::hardware {
namespace {

/// Sends what it is told and asks nothing.
struct GivenForce {
  std::array<const Eigen::VectorXd*, 2> force{};
  long next = 0;
  Expected<Command, Fault> step(const Measurement&) noexcept {
    const long k = next++;
    const auto at = [&](const Eigen::VectorXd* f) { return f && k < f->size() ? (*f)(k) : 0.0; };
    return Command{at(force[0]), at(force[1])};
  }
  void applied(const Command&) noexcept {}
};

/// Slope of y over x: hardly moved by the last value being late.
class Slope {
 public:
  void add(double x, double y) {
    ++n_;
    const double dx = x - mx_;
    mx_ += dx / n_;
    my_ += (y - my_) / n_;
    sxx_ += dx * (x - mx_);
    sxy_ += dx * (y - my_);
  }
  double value() const { return sxx_ > 0 ? sxy_ / sxx_ : 0; }

 private:
  double n_ = 0, mx_ = 0, my_ = 0, sxx_ = 0, sxy_ = 0;
};

/// One channel while it is being watched.
struct Watch {
  ChannelSurvey result;
  double sum = 0, differences = 0, before = 0, before_that = 0;
  long good = 0, in_a_row = 0, triples = 0, repeat = 0;
  Slope rate;

  void take(const rt::HardwareRig& rig, int axis, double tick) {
    const rt::InputState state = rig.state(axis);
    ++result.ticks;
    ++result.states[static_cast<std::size_t>(state)];
    if (rig.laser(axis)) {
      rate.add(tick, static_cast<double>(rig.sample(axis).index));
      if (state == rt::InputState::sensor_error)
        ++result.errors[static_cast<std::size_t>(rig.sample(axis).reading.error)];
    }
    const double d = rig.distance(axis);
    if ((state != rt::InputState::good && state != rt::InputState::stuck) || !std::isfinite(d)) {
      in_a_row = 0;
      return;
    }
    result.low = good == 0 ? d : std::min(result.low, d);
    result.high = good == 0 ? d : std::max(result.high, d);
    sum += d;
    ++good;
    repeat = in_a_row > 0 && d == before ? repeat + 1 : 0;
    result.longest_repeat = std::max(result.longest_repeat, repeat);
    if (++in_a_row >= 3) {
      const double second = d - 2 * before + before_that;
      differences += second * second;
      ++triples;
    }
    before_that = before;
    before = d;
  }
  ChannelSurvey done(const rt::HardwareRig& rig, int axis, double ticks_per_second) const {
    ChannelSurvey out = result;
    if (good > 0) out.mean = sum / static_cast<double>(good);
    if (triples > 0) out.noise = std::sqrt(differences / (6 * static_cast<double>(triples)));
    if (const rt::optoncdt::Sensor* laser = rig.laser(axis)) {
      out.frames = laser->statistics().frames;
      out.frames_lost = laser->lost_frames();
      out.bytes_dropped = laser->statistics().dropped;
      out.rate = rate.value() * ticks_per_second;
    }
    return out;
  }
};

/// Values of the ticks of an excitation; taken while the loop runs, so that it never grows.
class Ticks {
 public:
  explicit Ticks(Eigen::Index most) { values_.reserve(static_cast<std::size_t>(most)); }
  bool full() const noexcept { return values_.size() == values_.capacity(); }
  bool empty() const noexcept { return values_.empty(); }
  double last() const noexcept { return values_.back(); }
  // Ticks left out: the force was held, the displacement is taken from a straight line. Before the first value there
  // is nothing.
  void append(double value, long missed, bool held) noexcept {
    const double before = values_.empty() ? value : values_.back();
    for (long i = 1; i <= missed && !values_.empty() && !full(); ++i) {
      values_.push_back(held ? before
                             : before + (value - before) * static_cast<double>(i) / static_cast<double>(missed + 1));
    }
    if (!full()) values_.push_back(value);
  }
  Eigen::VectorXd vector() const {
    return Eigen::Map<const Eigen::VectorXd>(values_.data(), static_cast<Eigen::Index>(values_.size()));
  }

 private:
  std::vector<double> values_;
};

long cycles_of(const IoSettings& io, double seconds) { return std::lround(seconds * io.rate); }

template <class Loop>
void look(const IoSettings& io, double seconds, rt::HardwareRig& rig, Loop& loop, Idle& idle, LoopSurvey& out) {
  const rt::WallTime time;
  const bool by_board = rig.board_clock();
  std::array<Watch, 2> watch;
  Slope ticks;
  const std::int64_t begun = time.now();
  double tick = 0, turnarounds = 0;
  out.beta_first = rig.board().beta;
  for (long k = 0; k < cycles_of(io, seconds) && idle.answers() && idle.goes_on(); ++k) {
    const rt::CycleRecord r = idle.cycle(loop);
    const double t = 1e-9 * static_cast<double>(time.now() - begun);
    tick += 1 + static_cast<double>(r.missed);
    out.missed += r.missed;
    if (by_board) ticks.add(t, tick);
    for (int i = 0; i < 2; ++i) watch[static_cast<std::size_t>(i)].take(rig, i, by_board ? tick : t);
    const rt::BoardReading& b = rig.board();
    for (std::size_t i = 0; i < 4; ++i) out.analog[i] += (b.analog[i] - out.analog[i]) / static_cast<double>(k + 1);
    if (by_board && b.answered != 0) {
      const long around = static_cast<std::int32_t>(b.tick - b.answered);
      turnarounds += static_cast<double>(around);
      out.turnaround_max = std::max(out.turnaround_max, around);
      ++out.turnarounds;
    }
  }
  out.seconds = 1e-9 * static_cast<double>(time.now() - begun);
  out.board_rate = ticks.value();
  out.beta_last = rig.board().beta;
  out.omega = rig.board().omega;
  if (out.turnarounds > 0) out.turnaround_mean = turnarounds / static_cast<double>(out.turnarounds);
  for (int i = 0; i < 2; ++i) {
    out.channel[static_cast<std::size_t>(i)] = watch[static_cast<std::size_t>(i)].done(rig, i, by_board ? io.rate : 1);
  }
}

template <class Loop>
void excite(const IoSettings& io, double seconds, double excitation, Loop& loop, GivenForce& law, StopRequest stop,
            LoopSurvey& out) {
  const long ticks = cycles_of(io, seconds);
  std::array<Ticks, 2> sent{Ticks(ticks), Ticks(ticks)}, moved{Ticks(ticks), Ticks(ticks)};
  for (std::size_t axis = 0; axis < 2 && out.trip == Fault::none; ++axis) {
    const Eigen::VectorXd force = rt::telegraph(excitation, ticks, 1 + static_cast<unsigned>(axis));
    law = {};
    law.force[axis] = &force;
    loop.arm();
    while (!sent[axis].full()) {
      if (stop()) loop.stop();
      const rt::CycleRecord r = loop.cycle();
      if ((out.trip = r.trip) != Fault::none) break;  // its gap may be of any length
      sent[axis].append(axis == 0 ? r.sent.ux : r.sent.uy, r.missed, true);
      const double d = axis == 0 ? r.measurement.x : r.measurement.y;
      moved[axis].append(r.measurement.valid || moved[axis].empty() ? d : moved[axis].last(), r.missed, false);
    }
    loop.disarm();
    for (int k = 0; k < 10; ++k) loop.cycle();
  }
  if (out.trip != Fault::none) return;
  // Not before both axes are done: the loop would miss ticks meanwhile.
  for (std::size_t axis = 0; axis < 2; ++axis) {
    out.delay[axis] = rt::loop_delay(sent[axis].vector(), moved[axis].vector(), 1 / io.rate);
  }
}

template <class Clock>
void run(const IoSettings& io, double seconds, double excitation, rt::HardwareRig& rig, Clock& clock, StopRequest stop,
         LoopSurvey& out) {
  GivenForce law;
  rt::Loop loop(rig, law, clock, io.limits(), io.loop());
  Idle idle(io, rig, stop);
  idle.settle(io, loop);
  look(io, seconds, rig, loop, idle, out);
  if (excitation > 0) idle.watch_rest(loop);
  if (idle.stopped()) out.trip = Fault::requested;
  if (excitation <= 0 || rig.fault() != Fault::none || !idle.goes_on()) return;
  if (const std::string why = idle.rest().refusal(); !why.empty()) {
    out.summary.fail("excitation: " + why);
    return;
  }
  rig.stay_at_rest();
  excite(io, seconds, excitation, loop, law, stop, out);
}

// What is wrong, one sentence each.
std::vector<std::string> problems_of(const IoSettings& io, const LoopSurvey& s) {
  constexpr double kFew = 0.01, kRateError = 0.02, kNoise = 1e-3, kExplained = 0.5;
  std::vector<std::string> out;
  if (s.channel[0].ticks == 0) {
    out.push_back("board: no readings");
    return out;
  }
  if (s.board_rate > 0 && std::abs(s.board_rate / io.rate - 1) > kRateError) {
    out.push_back(
        fmt::format("board: {:.1f} ticks a second by this machine's clock instead of {:g}", s.board_rate, io.rate));
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const ChannelSurvey& c = s.channel[i];
    const rt::optoncdt::SensorOptions& laser = io.hardware.position[i].laser;
    const auto say = [&](const std::string& what) { out.push_back(fmt::format("{}: {}", i == 0 ? "x" : "y", what)); };
    for (int k = 1; k < rt::kInputStates; ++k) {
      const auto state = static_cast<rt::InputState>(k);
      if (c.share(state) <= kFew) continue;
      std::string why;
      if (state == rt::InputState::sensor_error) {
        const auto most = std::max_element(c.errors.begin(), c.errors.end()) - c.errors.begin();
        why = fmt::format(", mostly: {}", rt::optoncdt::to_string(static_cast<rt::optoncdt::SensorError>(most)));
      }
      say(fmt::format("{} in {:.1f} % of the ticks{}", to_string(state), 100 * c.share(state), why));
    }
    if (c.share(rt::InputState::good) == 0) continue;
    if (c.low < 0 || c.high > laser.range)
      say(fmt::format("distance {:.3f} to {:.3f} mm leaves the measuring range", 1e3 * c.low, 1e3 * c.high));
    if (c.noise > kNoise * laser.range)
      say(fmt::format("noise {:.1f} um rms is above 0.1 % of the range", 1e6 * c.noise));
    if (laser.device.empty()) continue;
    if (std::abs(c.rate / laser.measuring_rate - 1) > kRateError) {
      say(fmt::format("{:.1f} frames a second instead of {:g}", c.rate, laser.measuring_rate));
    }
    const double all = static_cast<double>(c.frames + c.frames_lost);
    if (static_cast<double>(c.frames_lost) > kFew * all)
      say(fmt::format("{} of {:.0f} frames lost", c.frames_lost, all));
  }
  if (s.trip != Fault::none && s.trip != Fault::requested)
    out.push_back("excitation: the loop tripped: " + std::string(to_string(s.trip)));
  for (std::size_t i = 0; i < 2; ++i) {
    const rt::LoopDelay& d = s.delay[i];
    const char* const name = i == 0 ? "x" : "y";
    if (d.frequency == 0 && d.explained == 0) continue;
    if (d.explained < kExplained) {
      out.push_back(
          fmt::format("{}: the excitation explains {:.0f} % of the motion only: no actuator, or too small a force",
                      name, 100 * d.explained));
    } else if (d.gain < 0) {
      out.push_back(fmt::format("{}: the force acts against its direction; see actuator.{}.direction", name, name));
    }
  }
  return out;
}

}  // namespace

LoopSurvey survey(const IoSettings& io, double seconds, double excitation, StopRequest stop) {
  std::optional<rt::HardwareRig> rig;
  const auto open = [&]() -> rt::HardwareRig& { return rig.emplace(io.hardware, io.board()); };
  return survey(io, open, seconds, excitation, stop);
}

LoopSurvey survey(const IoSettings& io, const OpenRig& open, double seconds, double excitation, StopRequest stop) {
  require_range("seconds", seconds, 0.5, 600, "s");
  require_range("excitation", excitation, 0, 1e4, "N");
  if (excitation > 0 && io.safety.displacement <= 0) {
    throw Error::in_file(io.source, 0, "safety.displacement_mm = 0: an excitation needs a displacement that trips");
  }
  IoSettings settings = io;
  settings.release = 0;
  rt::HardwareRig& rig = open();
  LoopSurvey out;
  // An excitation is for a shaft at rest, where a tacho has nothing to show.
  if (excitation <= 0) {
    try {
      out.angle = learn_tacho(io, rig, stop);
    } catch (const Error& e) {
      out.summary.fail(e.what());
    }
  }
  const rt::RealtimeThread realtime(io.realtime);
  rt::WallTime time;
  if (io.clock == "wall") {
    rt::PacedClock clock(time, io.pace());
    run(settings, seconds, excitation, rig, clock, stop, out);
  } else {
    rt::SampleClock clock(rig, time, io.pace(), io.watchdog_ns());
    run(settings, seconds, excitation, rig, clock, stop, out);
  }
  out.excitation = excitation;
  if (out.trip == Fault::requested) {
    out.summary.warn("stopped by a signal: not everything was looked at");
    if (out.channel[0].ticks == 0) return out;
  }
  for (const std::string& text : problems_of(io, out)) out.summary.fail(text);
  return out;
}

io::Json to_json(const IoSettings& io, const LoopSurvey& s) {
  io::Json json = io::start_document("whirl.io-test", 1);
  for (std::size_t i = 0; i < 2; ++i) {
    const ChannelSurvey& c = s.channel[i];
    io::Json channel = io::Json::object();
    channel.set("ticks", c.ticks).set("mean", c.mean).set("low", c.low).set("high", c.high).set("noise", c.noise);
    for (int k = 0; k < rt::kInputStates; ++k) {
      std::string key(to_string(static_cast<rt::InputState>(k)));
      std::replace(key.begin(), key.end(), ' ', '_');
      if (static_cast<rt::InputState>(k) == rt::InputState::current) key = "current";
      channel.set(key, c.share(static_cast<rt::InputState>(k)));
    }
    channel.set("longest_repeat", c.longest_repeat);
    if (!io.hardware.position[i].laser.device.empty()) {
      channel.set("rate", c.rate)
          .set("frames", static_cast<double>(c.frames))
          .set("frames_lost", static_cast<double>(c.frames_lost));
      channel.set("bytes_dropped", static_cast<double>(c.bytes_dropped));
    }
    if (s.excitation > 0) {
      const rt::LoopDelay& d = s.delay[i];
      io::Json delay = io::Json::object();
      delay.set("delay", d.delay)
          .set("deviation", d.deviation)
          .set("gain", d.gain)
          .set("frequency", d.frequency)
          .set("explained", d.explained);
      channel.set("excitation", delay);
    }
    json.set(i == 0 ? "x" : "y", channel);
  }
  io::Json board = io::Json::object();
  board.set("rate", s.board_rate)
      .set("missed", s.missed)
      .set("omega", s.omega)
      .set("turned", s.beta_last - s.beta_first);
  board.set("turnaround_mean", s.turnaround_mean)
      .set("turnaround_max", s.turnaround_max)
      .set("turnarounds", s.turnarounds);
  if (!s.angle.empty()) json.set("angle", s.angle);
  json.set("board", board).set("seconds", s.seconds).set("problems", s.summary.warnings);
  return json;
}

}  // namespace whirl::hardware
