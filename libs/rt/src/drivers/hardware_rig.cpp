#include "whirl/rt/drivers/hardware_rig.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/rt/faults.hpp"
#include "whirl/rt/realtime.hpp"

namespace whirl::rt {
namespace {

constexpr double kSmallestCurrent = 3.6e-3, kLargestCurrent = 20.4e-3;  // A, of a working 4..20 mA loop
constexpr long kApart = 1000;    // cycles after which a clock that runs apart is moved by a tick
constexpr double kTurned = 0.1;  // rad the rotor turns before a standing angle is suspicious
constexpr double kSlowing = 20;  // rad/s^2 by which any rotor may slow down without having been seen to
constexpr double kFastest = 6300, kFastestChange = 1e5;  // rad/s, rad/s^2: no such rotor is held by this program
constexpr double kJump = 0.5, kJumpRate = 0.5,
                 kJumpChange = 1e3;  // rad, share of the turn, rad/s^2: angle against speed
constexpr double kTickJump = 10;     // s

void check(const PositionInput& p, double rate) {
  if (p.direction != 1 && p.direction != -1)
    throw Error::in_field("direction", fmt::format("{}", p.direction), "1 or -1");
  require_range("gain", p.gain, 1e-3, 1e3);
  if (p.laser.device.empty()) {
    require_range("analog", p.analog, 0, 3);
    require_range("shunt", p.shunt, 10, 1000, "ohm");
  } else {
    const double ratio = p.laser.measuring_rate / rate;
    if (ratio < 1 - 1e-9 || std::abs(ratio - std::round(ratio)) > 1e-9) {
      throw Error::in_field("laser rate", fmt::format("{:g} Hz", p.laser.measuring_rate),
                            fmt::format("a multiple of the loop rate {:g} Hz", rate));
    }
  }
}

}  // namespace

std::string_view to_string(InputState state) {
  switch (state) {
    case InputState::good:
      return "good";
    case InputState::no_sample:
      return "no sample";
    case InputState::sensor_error:
      return "sensor error";
    case InputState::too_old:
      return "too old";
    case InputState::stuck:
      return "stuck";
    case InputState::current:
      return "current out of 4..20 mA";
  }
  return "?";
}

HardwareRig::HardwareRig(const HardwareOptions& options, std::unique_ptr<Board> board)
    : options_(options), board_(std::move(board)) {
  require_range("sample_time", options.sample_time, 1e-5, 1, "s");
  require_range("tacho.analog", options.tacho, -1, 3);
  for (const ForceOutput& f : options.force) {
    if (f.direction != 1 && f.direction != -1)
      throw Error::in_field("direction", fmt::format("{}", f.direction), "1 or -1");
    require_range("force_per_volt", f.force_per_volt, 1e-6, 1e6, "N/V");
    require_range("limit", f.limit, 0, 1000, "V");
  }
  for (std::size_t i = 0; i < 2; ++i) {
    PositionInput& p = options_.position[i];
    check(p, 1 / options.sample_time);
    if (p.laser.device.empty()) continue;
    p.laser.counter = true;  // lost frames must not shift time
    axes_[i].frames_per_tick = std::lround(p.laser.measuring_rate * options.sample_time);
    axes_[i].sensor.emplace(p.laser);
  }
}

HardwareRig::~HardwareRig() {
  armed_ = false;
  write({});
}

std::int64_t HardwareRig::Axis::frame_tick() const noexcept {
  const std::int64_t frame = static_cast<std::int64_t>(newest.index) + phase;
  return frame / frames_per_tick;
}

void HardwareRig::drain() noexcept {
  for (Axis& a : axes_) {
    if (!a.sensor) continue;
    std::array<optoncdt::Sample, 64> block;
    while (const std::size_t n = a.sensor->read(block)) {
      for (std::size_t i = 0; i < n; ++i) {
        a.repeated = a.seen && block[i].raw == a.newest.raw ? a.repeated + 1 : 0;
        // Ticks end where the counter is a multiple of the frames per tick.
        if (!a.seen) a.phase = static_cast<std::int64_t>(block[i].counter) - static_cast<std::int64_t>(block[i].index);
        a.seen = true;
        a.newest = block[i];
      }
    }
  }
  // After the lasers: a board reading that was not held back on its way never seems older than the frames that came
  // with it.
  if (by_board()) read_board();
}

void HardwareRig::read_board() noexcept {
  const BoardReading before = reading_;
  if (!board_->read(reading_)) return;
  read_tacho(before);
  restarted_ = restarted_ || (armed_ && board_seen_ && reading_.session != before.session);
  implausible_ = implausible_ || (armed_ && board_seen_ && !plausible(before));
  // A board that counts from its beginning again goes on from where it was.
  const auto ticks = static_cast<std::int32_t>(reading_.tick - before.tick);
  const bool anew = reading_.session != before.session || ticks < 0;
  if (board_seen_) board_tick_ += anew ? 1 : ticks;
  board_seen_ = board_fresh_ = true;
}

void HardwareRig::follow_tacho(const TachoTracker& tracker) noexcept {
  tacho_ = tracker;
  angles_known_ = angle_repeated_ = 0;
}

void HardwareRig::read_tacho(const BoardReading& before) noexcept {
  if (!tacho_) return;
  // A clock that was set, or a board that started anew: one tick.
  const auto ticks = static_cast<std::int32_t>(reading_.tick - before.tick);
  const bool sane =
      board_seen_ && reading_.session == before.session && ticks > 0 && ticks * options_.sample_time <= kTickJump;
  tacho_->update(reading_.analog[static_cast<std::size_t>(options_.tacho)], sane ? ticks : 1);
  reading_.beta = tacho_->beta();
  reading_.omega = tacho_->omega();
  reading_.omega_dot = tacho_->omega_dot();
}

bool HardwareRig::plausible(const BoardReading& before) const noexcept {
  const double ticks = static_cast<std::int32_t>(reading_.tick - before.tick);
  const double t = ticks * options_.sample_time;
  // Written so that NaN fails.
  if (!(t >= 0 && t <= kTickJump)) return false;
  if (!(std::abs(reading_.omega) <= kFastest && std::abs(reading_.omega_dot) <= kFastestChange)) return false;
  // The angle may be wrapped.
  const double led = 0.5 * (before.omega + reading_.omega) * t;
  const double jump = reading_.beta - before.beta - led;
  const double off = std::remainder(jump, 2 * std::numbers::pi);
  const double most = kJump + kJumpRate * std::abs(led) + 0.5 * kJumpChange * t * t;
  return std::abs(jump) <= 2 * std::numbers::pi + most && (std::abs(off) <= most || most >= std::numbers::pi);
}

// At the end of each cycle with a fresh reading: `last_beta_` is the angle of the cycle before.
void HardwareRig::follow_angle() noexcept {
  const long ticks = std::min<long>(angle_repeated_ + 1, static_cast<long>(angles_.size()));
  std::rotate(angles_.begin(), angles_.begin() + ticks, angles_.end());
  for (long i = ticks; i > 1; --i) angles_[angles_.size() - static_cast<std::size_t>(i)] = last_beta_;
  angles_.back() = reading_.beta;
  angles_known_ = std::min<long>(angles_known_ + ticks, static_cast<long>(angles_.size()));
}

// A rotor that stops is seen to slow down before; a dead encoder stops in full turn. The speed of the board is filtered
// and overshoots when the rotor comes to rest, so that it cannot decide.
bool HardwareRig::encoder_dead() const noexcept {
  const double stood = static_cast<double>(angle_repeated_) * options_.sample_time;
  if (options_.stuck <= 0 || stood <= options_.stuck) return false;
  const long window = std::clamp(std::lround(10e-3 / options_.sample_time), 2L, 20L);
  const auto last = static_cast<long>(angles_.size()) - 1;
  if (angles_known_ <= 3 * window) return std::abs(reading_.omega) * stood > kTurned;
  const auto speed = [&](long end) {
    return std::abs(angles_[static_cast<std::size_t>(end)] - angles_[static_cast<std::size_t>(end - window)]) /
           (static_cast<double>(window) * options_.sample_time);
  };
  const double v = speed(last), before = speed(last - 2 * window);
  const double slowing = std::max(0.0, before - v) / (2 * static_cast<double>(window) * options_.sample_time);
  const double a = 2 * slowing + kSlowing;
  // A board that measures speed by itself may say that the rotor turns although the angle never moved.
  if (std::abs(reading_.omega) > 3 * (v + before) + 5 && std::abs(reading_.omega) * stood > kTurned) return true;
  const double turned = v > a * stood ? (v - 0.5 * a * stood) * stood : 0.5 * v * v / a;
  return turned > kTurned;
}

void HardwareRig::align(std::int64_t now) noexcept {
  if (by_board() && !board_seen_) return;
  for (Axis& a : axes_) {
    if (a.sensor && a.seen) a.alignment.see(now, now - a.frame_tick());
  }
}

void HardwareRig::follow_clocks() noexcept {
  const auto moved = [this](long& apart, std::int64_t tick) {
    const std::int64_t behind = tick_ - tick;
    const bool usable = static_cast<double>(behind) * options_.sample_time <= options_.max_age;
    apart = behind > 0 && usable ? std::max(apart, 0L) + 1 : behind < 0 ? std::min(apart, 0L) - 1 : 0;
    if (std::abs(apart) < kApart) return 0;
    const int by = apart > 0 ? 1 : -1;
    apart = 0;
    return by;
  };
  for (Axis& a : axes_) {
    if (a.sensor && a.alignment.known()) a.alignment.move(moved(a.apart, a.tick()));
  }
  if (by_board() && board_seen_) board_tick_ += moved(board_apart_, board_tick_);
}

// Of the sources that say what a tick is: armed, the lasers do so too, so that a silent board does not end the control.
std::int64_t HardwareRig::newest() const noexcept {
  std::int64_t newest = by_board() && board_seen_ ? board_tick_ : INT64_MIN;
  for (const Axis& a : axes_) {
    if (a.sensor && a.alignment.known() && (armed_ || !by_board())) newest = std::max(newest, a.tick());
  }
  return newest == INT64_MIN ? tick_ : newest;
}

bool HardwareRig::complete(std::int64_t tick, bool all) const noexcept {
  // What has had nothing valid to say for a while is not waited for.
  const auto late = static_cast<std::int64_t>(options_.max_age / options_.sample_time) + 1;
  const auto reached = [&](bool there, bool known, std::int64_t at) {
    const bool counts = there && (all ? !known || at + late >= tick : known);
    return counts ? known && at >= tick : all;
  };
  const auto laser = [&](const Axis& a) {
    return reached(a.sensor && a.sensor->connected(), a.alignment.known(), a.tick());
  };
  const bool b = reached(by_board(), board_seen_, board_tick_);
  return all ? b && laser(axes_[0]) && laser(axes_[1]) : b || laser(axes_[0]) || laser(axes_[1]);
}

long HardwareRig::wait(std::int64_t timeout) noexcept {
  const WallTime time;
  std::int64_t deadline = time.now() + timeout;
  bool some = false;
  // A laser, or the board, that started again left the tick ahead of what comes now: that is not waited for.
  if (!armed_ && newest() < tick_) start_ -= tick_ - newest(), tick_ = newest();
  while (true) {
    drain();
    if (!armed_ && !by_board() && first().seen && !first().alignment.known()) tick_ = first().frame_tick();
    if (!armed_ && (by_board() || first().seen)) align(by_board() ? board_tick_ : first().frame_tick());
    const std::int64_t now = time.now();
    // While the order of the samples is being learned, the board says what a tick is and everything that may still
    // come is waited for.
    if (!some && (armed_ || !by_board() ? complete(tick_ + 1, false) : board_tick_ > tick_)) {
      some = true;
      const double grace = armed_ ? options_.grace : std::min(options_.grace, 0.5 * options_.sample_time);
      deadline = std::min(deadline, now + static_cast<std::int64_t>(1e9 * grace));
    }
    const bool lost = !board_->connected() && board_->loss() == kBoardLost;
    if (armed_ && (lost || complete(tick_ + 1, true))) break;
    if (now >= deadline) break;
    std::array<pollfd, 3> fds;
    nfds_t count = 0;
    if (by_board() && (!armed_ || board_tick_ <= tick_)) fds[count++] = {board_->descriptor(), POLLIN, 0};
    for (const Axis& a : axes_) {
      if (a.sensor && a.sensor->connected() && (!armed_ || !a.alignment.known() || a.tick() <= tick_)) {
        fds[count++] = {a.sensor->descriptor(), POLLIN, 0};
      }
    }
    const timespec left{(deadline - now) / 1'000'000'000, (deadline - now) % 1'000'000'000};
    ::ppoll(fds.data(), count, &left, nullptr);
  }
  waited_ = true;
  const std::int64_t advanced = newest() - tick_;
  if (advanced <= 0) {
    const long waited = std::max(std::lround(1e-9 * static_cast<double>(timeout) / options_.sample_time), 1L);
    in_vain_ += waited, board_silent_ += waited;
    return 0;
  }
  in_vain_ = 0;
  board_silent_ += advanced;
  tick_ = newest();
  return static_cast<long>(advanced);
}

InputState HardwareRig::examine(Axis& a, const PositionInput& input) noexcept {
  const double sample_rate = a.sensor ? input.laser.measuring_rate : 1 / options_.sample_time;
  if (!a.sensor) {
    const double volts = reading_.analog[static_cast<std::size_t>(input.analog)];
    const double current = volts / input.shunt;
    a.repeated = volts == a.last_analog ? a.repeated + 1 : 0;
    a.last_analog = volts;
    a.distance = (current - 4e-3) / 16e-3 * input.laser.range;
    if (!board_seen_) return InputState::no_sample;
    if (!(current >= kSmallestCurrent && current <= kLargestCurrent)) return InputState::current;
  } else {
    if (!a.seen || !a.alignment.known() || !a.sensor->connected()) return InputState::no_sample;
    a.distance = a.newest.reading.distance;
    const std::int64_t behind = tick_ - a.tick() + in_vain_;
    if (behind > 0) ++a.late;
    if (static_cast<double>(behind) * options_.sample_time > options_.max_age) return InputState::too_old;
    if (a.newest.reading.error != optoncdt::SensorError::none) return InputState::sensor_error;
  }
  if (options_.stuck > 0 && static_cast<double>(a.repeated) > options_.stuck * sample_rate) return InputState::stuck;
  return InputState::good;
}

Measurement HardwareRig::read() noexcept {
  if (!waited_) {  // the loop runs on a clock of its own: take what is there
    drain();
    in_vain_ = 0;
    board_silent_ += 1 + left_out_;
    tick_ = !by_board() ? tick_ + 1 + left_out_ : armed_ ? std::max(tick_, board_tick_) : board_tick_;
    if (!armed_) align(tick_);
  }
  if (!by_board()) {
    board_->left_out(left_out_);
    read_board();
  }
  waited_ = false;
  left_out_ = 0;
  if (armed_) follow_clocks();
  if (board_fresh_) board_silent_ = 0;
  if (!armed_ || reading_.beta != last_beta_) {
    follow_angle();
    angle_repeated_ = 0;
  } else if (board_fresh_) {
    ++angle_repeated_;
  }
  last_beta_ = reading_.beta;
  board_fresh_ = false;
  Measurement m;
  m.t = static_cast<double>(tick_ - start_) * options_.sample_time;
  m.beta = reading_.beta;
  m.omega = reading_.omega;
  m.omega_dot = reading_.omega_dot;
  std::array<double, 2> z;
  for (std::size_t i = 0; i < 2; ++i) {
    const PositionInput& p = options_.position[i];
    axes_[i].state = examine(axes_[i], p);
    z[i] = p.direction * p.gain * (axes_[i].distance - p.offset);
    if (axes_[i].state != InputState::good) {
      m.valid = false;
      if (!std::isfinite(z[i])) z[i] = 0;
    }
  }
  m.x = z[0];
  m.y = z[1];
  return m;
}

void HardwareRig::write(const Command& force) noexcept {
  BoardCommand c;
  const std::array<double, 2> u{force.ux, force.uy};
  for (std::size_t i = 0; i < 2; ++i) {
    const ForceOutput& f = options_.force[i];
    const double volts = f.direction * u[i] / f.force_per_volt + f.offset;
    c.volts[i] = armed_ && std::isfinite(volts) ? std::clamp(volts, -f.limit, f.limit) : 0;
  }
  c.answers = reading_.tick;
  c.armed = armed_;
  c.start = (armed_ && !at_rest_) || started_;
  board_->write(c);
}

void HardwareRig::arm(bool armed) noexcept {
  if (armed && !armed_) start_ = tick_ + 1;
  if (armed != armed_) implausible_ = restarted_ = false;
  armed_ = armed;
}

Fault HardwareRig::fault() const noexcept {
  if (reading_.done) return Fault::none;
  if (!board_seen_) return Fault::watchdog;
  if (restarted_) return kBoardRestarted;  // which a watchdog would hide
  if (!board_->connected()) return board_->loss();
  if (armed_ && reading_.expired) return Fault::watchdog;
  if (static_cast<double>(board_silent_) * options_.sample_time > options_.board_timeout) return Fault::watchdog;
  if (implausible_) return kImplausible;
  return (tacho_ && tacho_->lost()) || encoder_dead() ? kEncoderStuck : Fault::none;
}

}  // namespace whirl::rt
