#include "whirl/hardware/rig_server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/hardware/board_socket.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/rig/segments.hpp"
#include "whirl/rt/realtime.hpp"

namespace whirl::hardware {
namespace {

constexpr double kShunt = 250;             // ohm, of the analogue outputs
constexpr int kLockstepWait = 2000;        // ms until a silent controller is taken for dead
constexpr double kLockstepGrace = 0.1;     // s that a frame may be late because this process was put aside
constexpr double kBefore = -1;             // s, the time of faults that are there before the start
constexpr double kRestTime = 30;           // s that a shaft at rest can be excited
constexpr std::uint32_t kBehind = 262078;  // peak behind the measuring range

// The same machine, stepped once per laser frame.
rig::RigParameters frame_by_frame(rig::RigParameters p, long& ratio) {
  const double frames = p.laser.rate / p.timing.rate;
  ratio = std::lround(frames);
  if (ratio < 1 || std::abs(frames - static_cast<double>(ratio)) > 1e-9) {
    throw Error::in_field("laser.rate_hz", fmt::format("{:g}", p.laser.rate),
                          "a multiple of timing.rate_hz, to be served");
  }
  if (p.actuator.delay_samples < 1) {
    throw Error::in_field("actuator.delay_samples", fmt::format("{}", p.actuator.delay_samples),
                          "at least 1: a served rig gets its command after the tick");
  }
  const int parts = static_cast<int>(ratio);
  p.timing.rate = p.laser.rate;
  if (p.timing.substeps % parts == 0) p.timing.substeps /= parts;
  p.actuator.delay_samples *= parts;
  p.actuator.extra_delay_samples *= parts;
  p.laser.bits = 0;  // the frame has its own resolution
  p.check();
  return p;
}

// Its shaft standing at the first angle of the profile.
rig::RigParameters at_rest(rig::RigParameters p) {
  rotor::SpeedProfile stand;
  stand.beta_start = p.profile.beta_start;
  stand.ramp_time = kRestTime;
  p.profile = stand;
  for (rig::RigMode& m : p.modes) m.initial = 0;
  return p;
}

// A fifth of what the run shows without control, so that a loop that has lost its actuators ends long before that; a
// millimetre at least, for the start and for weak controllers.
double displacement_limit(const rig::RigParameters& p) {
  return std::clamp(0.2 * tuning::ClosedLoopPlant(p).open().all, 1e-3, 0.3 * p.laser.range);
}

rig::RigRun frame_by_frame(rig::RigRun run, long ratio) {
  for (rig::ScriptedFault& f : run.faults) f.delay_samples *= static_cast<int>(ratio);
  return run;
}

}  // namespace

void read_faults(const std::filesystem::path& path, ServeOptions& options) {
  const io::Settings s = io::read_settings(path);
  const std::pair<const char*, rig::RigFault> machine[] = {{"stuck", rig::RigFault::sensor_stuck},
                                                           {"command_delay", rig::RigFault::extra_delay},
                                                           {"actuator_loss", rig::RigFault::actuator_loss},
                                                           {"encoder_stuck", rig::RigFault::encoder_stuck}};
  const std::pair<const char*, LineFault> wires[] = {
      {"lost_bytes", LineFault::lost_bytes}, {"error_code", LineFault::error_code},     {"dropout", LineFault::dropout},
      {"delay", LineFault::delay},           {"board_silent", LineFault::board_silent}, {"gap", LineFault::gap}};
  for (std::size_t i = 0; i < s.count("fault"); ++i) {
    const auto key = [&](const char* name) { return fmt::format("fault[{}].{}", i, name); };
    const std::string kind = s.text(key("kind"), "",
                                    {"stuck", "command_delay", "actuator_loss", "encoder_stuck", "lost_bytes",
                                     "error_code", "dropout", "delay", "board_silent", "gap"});
    const double start = s.require_number(key("start"), Quantity::time, kBefore);
    const double end = s.number(key("end"), Quantity::time, 1e9, start);
    const std::string where = s.text(key("axis"), "both", {"both", "x", "y"});
    const rig::RigAxis axis = where == "x" ? rig::RigAxis::x : where == "y" ? rig::RigAxis::y : rig::RigAxis::both;
    const double delay = s.number(key("delay"), Quantity::time, 0, 0, 10);
    const long every = s.integer(key("every"), 50, 1, 1000000), code = s.integer(key("code"), 262076, 0, 262143);
    for (const auto& [name, fault] : machine) {
      if (kind == name) {
        options.run.faults.push_back(
            {fault, start, end, axis, static_cast<int>(std::lround(delay * options.rig.timing.rate))});
      }
    }
    for (const auto& [name, fault] : wires) {
      if (kind == name) {
        options.line_faults.push_back(
            {fault, start, end, axis, static_cast<unsigned>(every), static_cast<std::uint32_t>(code), delay});
      }
    }
  }
  s.finish();
}

RigServer::RigServer(const ServeOptions& options)
    : options_(options),
      fine_(frame_by_frame(options.rig, ratio_)),
      rig_(fine_, frame_by_frame(options.run, ratio_)),
      rest_tables_(rig::make_rig_tables(at_rest(fine_))),
      scale_(options.rig.laser.range),
      socket_(std::make_unique<BoardSocket>(options.address, options.key_file)),
      standby_(options.run.seed) {
  for (Axis& axis : axes_) axis.line.only_rate = options.rig.laser.rate;
}

RigServer::~RigServer() = default;

long RigServer::refused() const { return socket_->refused(); }

IoSettings RigServer::io() const {
  IoSettings io;
  io.rate = options_.rig.timing.rate;
  io.address = socket_->address();
  if (!options_.key_file.empty()) io.key_file = std::filesystem::absolute(options_.key_file).string();
  io.safety.displacement = displacement_limit(options_.rig);
  io.hardware.grace = 0.5 / io.rate;
  if (options_.lockstep) io.clock = "lockstep", io.hardware.grace = kLockstepGrace, io.watchdog = 1;
  for (std::size_t i = 0; i < 2; ++i) {
    rt::PositionInput& p = io.hardware.position[i];
    p.laser.device = axes_[i].line.device();
    p.laser.measuring_rate = options_.rig.laser.rate;
    p.laser.range = options_.rig.laser.range;
    p.laser.timeout = 5;
    p.offset = 0.5 * options_.rig.laser.range;
    p.shunt = kShunt;
    io.hardware.force[i].force_per_volt = options_.rig.actuator.force_per_volt;
    io.hardware.force[i].limit = options_.rig.actuator.voltage_limit;
  }
  return io;
}

void RigServer::start_time() { next_ = rt::WallTime{}.now(); }

bool RigServer::finished() const {
  // A little longer, so that the other side sees the end.
  return rig_.done() && after_end_ > static_cast<long>(0.2 * options_.rig.timing.rate);
}

const ScriptedLineFault* RigServer::active(LineFault kind, int axis) const {
  const double t = started_ ? rig_.time() : kBefore;
  for (const ScriptedLineFault& f : options_.line_faults) {
    const bool here = f.axis == rig::RigAxis::both || (f.axis == rig::RigAxis::x) == (axis == 0);
    if (f.kind == kind && here && t >= f.start && t < f.end) return &f;
  }
  return nullptr;
}

std::uint32_t RigServer::raw(double displacement, bool valid, int axis) const {
  if (const ScriptedLineFault* f = active(LineFault::error_code, axis)) return f->code;
  const double range = options_.rig.laser.range;
  const double steps = (displacement / range + 0.5 + 0.01) * 65520 / 1.02;
  return valid && steps >= 0 && steps <= 65520 ? static_cast<std::uint32_t>(std::lround(steps)) : kBehind;
}

void RigServer::receive() {
  while (const auto heard = socket_->receive(expired_)) {
    if (!heard->same) locked_ = false, lockstep_lost_ = lockstep_lost_ && started_;
    command_ = heard->numbered.command;
    last_answers_ = command_.answers;
    // It sees the ticks: from now on each one waits for it.
    locked_ = locked_ || (options_.lockstep && heard->same && last_answers_ != 0);
    silent_ = 0;
    ++commands_;
    if (!command_.armed) expired_ = false;
    started_ = started_ || command_.start;
  }
}

void RigServer::wait_for_command() {
  const std::int64_t until = rt::WallTime{}.now() + std::int64_t{1'000'000} * kLockstepWait;
  const bool heard = !active(LineFault::board_silent, 0);  // otherwise nothing can be answered: any command will do
  const long before = commands_;
  while (rt::WallTime{}.now() < until) {
    for (Axis& a : axes_) a.line.answer(), a.line.flush();
    receive();
    if (heard ? static_cast<std::int32_t>(last_answers_ - board_tick_) >= 0 : commands_ > before) return;
    pollfd p{socket_->descriptor(), POLLIN, 0};
    ::poll(&p, 1, 10);
  }
  lockstep_lost_ = true;
}

void RigServer::measure(int sub) {
  const std::uint64_t number = static_cast<std::uint64_t>(board_tick_) * static_cast<std::uint64_t>(ratio_) -
                               static_cast<std::uint64_t>(ratio_ - 1 - sub);
  Measurement m = machine().read();
  if (!started_ && !rest_) {  // the shaft waits; a laser is never quite still
    // What a controller sees before its start must not depend on how long the machine stood.
    if (options_.lockstep && sub == 0) standby_.seed(options_.run.seed + board_tick_ % kLockstepCycle);
    const auto noise = [&] {
      return std::sqrt(3.0) * options_.rig.laser.noise * (2 * static_cast<double>(standby_() >> 11) * 0x1p-53 - 1);
    };
    m.x += noise();
    m.y += noise();
  }
  for (int i = 0; i < 2; ++i) {
    Axis& a = axes_[static_cast<std::size_t>(i)];
    if (active(LineFault::dropout, i) || active(LineFault::gap, i)) continue;
    const ScriptedLineFault* late = active(LineFault::delay, i);
    const long ticks = late ? std::lround(late->delay * options_.rig.timing.rate) : 0;
    a.queue.push_back({static_cast<long>(board_tick_) + ticks, raw(i == 0 ? m.x : m.y, m.valid, i), number});
  }
}

void RigServer::send_reading() {
  if (!socket_->commanded() || active(LineFault::board_silent, 0) || active(LineFault::gap, 0)) return;
  const Measurement m = machine().read();
  rt::BoardReading r;
  r.tick = board_tick_;
  r.beta = m.beta;
  if (started_) r.omega = m.omega, r.omega_dot = m.omega_dot;
  const double range = options_.rig.laser.range;
  r.analog[0] = kShunt * (4e-3 + 16e-3 * (m.x / range + 0.5));
  r.analog[1] = kShunt * (4e-3 + 16e-3 * (m.y / range + 0.5));
  r.answered = last_answers_;
  r.output = command_.armed && !expired_;
  r.expired = expired_;
  r.done = rig_.done();
  r.session = static_cast<std::uint16_t>(::getpid() % 65535 + 1);
  socket_->send(r);
}

void RigServer::tick() {
  const double period = 1 / options_.rig.timing.rate;
  // The reading that says that the run is over is waited for too: it ends the other side's record.
  if (locked_ && !lockstep_lost_ && after_end_ <= 1) {
    // Nobody was told of a tick in a gap.
    if (!active(LineFault::gap, 0)) wait_for_command();
    next_ = rt::WallTime{}.now();
  } else {
    next_ += std::llround(1e9 * period);
    // Where this process itself was not let run, time stood still for the machine: it does not hurry after it.
    const std::int64_t late = rt::WallTime{}.now() - next_;
    if (late > std::llround(1e9 * period)) next_ += late, slipped_ += 1e-9 * static_cast<double>(late);
    rt::WallTime{}.sleep_until(next_);
    for (Axis& a : axes_) a.line.answer();
    receive();
  }
  if (socket_->commanded() && static_cast<double>(++silent_) * period > options_.watchdog && !expired_) {
    expired_ = true;
    if (command_.armed) ++expired_count_;
  }
  const bool live = command_.armed && !expired_;
  const double k = options_.rig.actuator.force_per_volt;
  const rig::RigTruth truth(rig_);
  const bool moves = started_ && !rig_.done();
  if (started_ || expired_) {
    rest_.reset();
  } else if (live && !rest_) {
    rig::RigRun run = frame_by_frame(options_.run, ratio_);
    std::erase_if(run.faults, [](const rig::ScriptedFault& f) { return f.start >= 0; });
    rest_.emplace(rest_tables_, run);
  }
  const Command force{k * command_.volts[0], k * command_.volts[1]};
  if (rest_) rest_->write(live ? force : Command{});
  if (moves) {
    truth_x_.push_back(truth.z().real());
    truth_y_.push_back(truth.z().imag());
    truth_omega_.push_back(truth.angle().omega);
    truth_beta_.push_back(truth.angle().beta);
    radial_ = std::max(radial_, std::abs(truth.z()));
    rig_.write(live ? force : Command{});
  }
  ++board_tick_;
  for (int sub = 0; sub < ratio_; ++sub) {
    if (moves || rest_) machine().advance();
    measure(sub);
  }
  if (moves) {
    force_x_.push_back(truth.commanded().real());
    force_y_.push_back(truth.commanded().imag());
  }
  if (rig_.done()) ++after_end_;
  send_reading();
  for (int i = 0; i < 2; ++i) {
    Axis& a = axes_[static_cast<std::size_t>(i)];
    const ScriptedLineFault* lost = active(LineFault::lost_bytes, i);
    a.line.lose_byte_every = lost ? lost->every : 0;
    for (; !a.queue.empty() && a.queue.front().due <= static_cast<long>(board_tick_); a.queue.pop_front()) {
      a.line.send(a.queue.front().raw, a.queue.front().number);
    }
    a.line.flush();
  }
}

tuning::ClosedLoopMetrics RigServer::metrics() const {
  tuning::ClosedLoopMetrics m;
  const double rate = options_.rig.timing.rate;
  const auto vector = [](const std::vector<double>& v) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size())));
  };
  const tuning::ClosedLoopOptions defaults;
  m.open = tuning::ClosedLoopPlant(options_.rig).open();
  if (truth_x_.empty()) return m;
  const std::vector<int> segment =
      rig::segments(vector(truth_omega_), options_.rig.natural_frequency(), defaults.bounds);
  m.closed = rig::segment_peaks(vector(truth_x_), segment, std::lround(defaults.skip * rate));
  m.suppression = rig::suppression(m.open, m.closed);
  m.radial_peak = radial_;
  double square = 0, last = 0;
  for (const double u : force_x_) {
    square += u * u;
    m.force_peak = std::max(m.force_peak, std::abs(u));
    m.total_variation += std::abs(u - last);
    last = u;
  }
  const double n = static_cast<double>(force_x_.size());
  m.force_rms = std::sqrt(square / n);
  const Eigen::VectorXd across = vector(force_y_);
  m.force_y_rms = std::sqrt(across.squaredNorm() / n);
  m.force_y_peak = across.cwiseAbs().maxCoeff();
  m.total_variation /= n / rate;
  m.survived = n * static_cast<double>(ratio_) / static_cast<double>(rig_.ticks());
  tuning::JudgedRun judged;
  judged.open = m.open;
  judged.closed = m.closed;
  m.verdict = tuning::judge(judged);
  if (!rig::RigTruth(rig_).finite()) m.verdict.reasons.insert(m.verdict.reasons.begin(), "the motion diverged");
  m.stable = m.verdict.passed();
  return m;
}

Recording RigServer::truth() const {
  Recording out;
  out.dt = 1 / options_.rig.timing.rate;
  out.source = "served simulated rig";
  const auto add = [&](const char* name, Quantity quantity, const std::vector<double>& v) {
    out.add(name, quantity, Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size())));
  };
  add("x_true", Quantity::displacement, truth_x_);
  add("y_true", Quantity::displacement, truth_y_);
  add("ux", Quantity::force, force_x_);
  add("uy", Quantity::force, force_y_);
  add("beta", Quantity::angle, truth_beta_);
  add("omega", Quantity::angular_velocity, truth_omega_);
  return out;
}

}  // namespace whirl::hardware
