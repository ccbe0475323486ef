#include "learn_tacho.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/rt/realtime.hpp"
#include "whirl/signal/tacho.hpp"

namespace whirl::hardware {
namespace {

constexpr double kMostLost = 0.02;     // of the ticks: pulses of a steady rotor are then still counted
constexpr double kTicksAPulse = 4;     // level, edge, level, edge: fewer do not show both levels of every pulse
constexpr std::size_t kFewPulses = 6;  // what angle_from_pulses takes
constexpr const char* kChannel = "tacho";

signal::TachoOptions stated(const TachoSettings& t) {
  using enum signal::Edge;
  return {t.pulses, t.missing,
          t.edge == "rising"    ? rising
          : t.edge == "falling" ? falling
          : t.edge == "both"    ? both
                                : automatic};
}

/// The tacho and the displacements of the ticks of `seconds`; ticks that did not come hold the value before.
/// Empty when `stop` ended it. `at`: the instant of the last one, ns.
Recording watch(const IoSettings& io, rt::HardwareRig& rig, StopRequest stop, std::int64_t& at) {
  const auto n = static_cast<Eigen::Index>(std::lround(io.tacho.learn * io.rate));
  const auto input = static_cast<std::size_t>(io.tacho.analog);
  Eigen::VectorXd volts(n), x(n), y(n);
  const rt::RealtimeThread realtime(io.realtime);
  rt::WallTime time;
  const std::int64_t start = time.now(), period = std::llround(1e9 / io.rate);
  at = start;
  Eigen::Index filled = 0, lost = 0;
  std::uint32_t before = 0;
  rig.write({});  // the board answers to whoever commands it
  while (filled < n) {
    if (stop()) return {};
    long missed = 0;
    if (io.clock == "wall") {
      at += period;
      time.sleep_until(at);
      missed = static_cast<long>((time.now() - at) / period);
      at += missed * period;
    } else {
      missed = std::max(rig.wait(io.watchdog_ns()) - 1, 0L);
    }
    rig.left_out(missed);
    const Measurement m = rig.read();
    rig.write({});
    const rt::BoardReading& b = rig.board();
    const auto ticks = static_cast<std::int32_t>(b.tick - before);
    if (time.now() - start > static_cast<std::int64_t>(2e9 * io.tacho.learn) + 2 * io.watchdog_ns())
      throw Error::in_file(io.source, 0, "tacho: the board does not answer often enough to learn the marks");
    if (filled > 0 && ticks <= 0) continue;
    const Eigen::Index steps = filled == 0 ? 1 : std::min<Eigen::Index>(ticks, n - filled);
    lost += steps - 1;
    for (Eigen::Index i = 0; i < steps; ++i, ++filled)
      volts[filled] = b.analog[input], x[filled] = m.x, y[filled] = m.y;
    before = b.tick;
  }
  if (static_cast<double>(lost) > kMostLost * static_cast<double>(n))
    throw Error::in_file(io.source, 0,
                         fmt::format("tacho: {} of {} ticks were lost while its marks were learned", lost, n));
  Recording out;
  out.dt = 1 / io.rate;
  out.source = io.source;
  out.add(kChannel, Quantity::voltage, volts);
  out.add("x", Quantity::displacement, x);
  out.add("y", Quantity::displacement, y);
  return out;
}

void require_turning(const IoSettings& io, const signal::PulseTrain& train, double learned) {
  if (train.times.size() < kFewPulses)
    throw Error::in_file(
        io.source, 0,
        fmt::format("tacho: {} pulses on input {} in {:g} s ({:.2f} to {:.2f} V): at least {} are needed. Let the "
                    "rotor turn before the run begins, or set tacho.learn_s",
                    train.times.size(), io.tacho.analog, learned, train.bottom, train.top, kFewPulses));
  std::vector<double> steps;
  for (std::size_t k = 1; k < train.times.size(); ++k) steps.push_back(train.times[k] - train.times[k - 1]);
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  const double step = steps[steps.size() / 2];
  if (step * io.rate < kTicksAPulse)
    throw Error::in_file(
        io.source, 0,
        fmt::format("tacho: {:.1f} ticks a pulse at {:g} Hz: at least {:g} are needed. Use fewer marks a turn, a "
                    "faster loop, or a counter of the board (board.counts)",
                    step * io.rate, io.rate, kTicksAPulse));
}

}  // namespace

std::vector<std::string> learn_tacho(const IoSettings& io, rt::HardwareRig& rig, StopRequest stop) {
  std::vector<std::string> said;
  if (io.tacho.analog < 0) return said;
  std::int64_t watched = 0;
  const Recording seen = watch(io, rig, stop, watched);
  if (seen.channels.empty()) return said;
  const signal::TachoOptions tacho = stated(io.tacho);
  const signal::PulseTrain train = signal::pulse_train(seen[kChannel], seen.dt, tacho.edge);
  require_turning(io, train, io.tacho.learn);
  const signal::AngleFit fit = [&] {
    try {
      return signal::angle_of_tacho(seen, kChannel, tacho, said);
    } catch (const Error& e) {
      throw Error(fmt::format("{} (in this file: tacho.pulses, tacho.missing, tacho.edge)", e.what()));
    }
  }();
  rt::TachoMarks marks;
  marks.marks = fit.pattern.marks;
  marks.bottom = train.bottom;
  marks.top = train.top;
  marks.rising = train.edge != signal::Edge::falling;
  marks.falling = train.edge != signal::Edge::rising;
  marks.bandwidth = io.vendor.bandwidth;
  marks.sample_time = seen.dt;
  // From its middle on, so that the tracker is in step when the loop begins; the fit's own end is not trusted.
  const Eigen::Index first = seen.size() / 2;
  rt::TachoTracker tracker(marks, fit.angle.beta[2 * first], fit.angle.omega[2 * first], fit.angle.alpha[2 * first]);
  for (Eigen::Index i = first + 1; i < seen.size(); ++i) tracker.update(seen[kChannel][i], 1);
  if (tracker.lost())
    throw Error::in_file(io.source, 0, "tacho: its pulses are not followed: its signal or its speed is too uneven");
  rig.follow_tacho(tracker);
  // The clock of the loop begins anew; a board without one is told what it did not see meanwhile.
  if (io.clock == "wall")
    rig.left_out(std::lround(1e-9 * io.rate * static_cast<double>(rt::WallTime{}.now() - watched)));
  return said;
}

}  // namespace whirl::hardware
