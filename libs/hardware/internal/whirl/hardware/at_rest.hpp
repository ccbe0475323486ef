#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "whirl/hardware/io_settings.hpp"
#include "whirl/hardware/run_loop.hpp"

namespace whirl::hardware {

/// How long, in real time, a board has said nothing. Cycles do not tell: each may wait for the whole watchdog's time.
class BoardSilence {
 public:
  /// `most`, ns: allowed.
  explicit BoardSilence(std::int64_t now, std::int64_t most = 5'000'000'000) noexcept : since_(now), most_(most) {}
  /// After each cycle, with the tick of the board's newest reading: whether it has been silent for too long.
  bool too_long(std::uint32_t tick, std::int64_t now) noexcept {
    if (tick != tick_) tick_ = tick, since_ = now;
    return now - since_ > most_;
  }

 private:
  std::uint32_t tick_ = 0;
  std::int64_t since_, most_;
};

/// Whether the shaft is at rest, from what the board said while no force acted.
class RestWatch {
 public:
  explicit RestWatch(const IoSettings& io) noexcept;
  /// After each cycle without force.
  void see(const rt::BoardReading& reading) noexcept;
  /// It was watched for long enough: for a tacho, as long as its marks would be learned.
  bool enough() const noexcept { return ticks_ >= least_; }
  /// Why no force may be sent, and what to do; empty: the shaft is at rest.
  std::string refusal() const;

 private:
  int tacho_;
  double limit_, memory_;
  long ticks_ = 0, least_;
  double speed_ = 0;                  ///< rad/s, mean of the last ticks
  std::array<double, 3> low_, high_;  ///< of the tacho, V; the outermost last
};

/// The cycles of a loop without force: watched for rest, ended by a stop or a silent board.
class Idle {
 public:
  Idle(const IoSettings& io, rt::HardwareRig& rig, StopRequest stop) noexcept
      : rig_(rig), stop_(stop), silence_(time_.now()), rest_(io) {
    rig.write({});  // the board answers to whoever commands it
  }
  /// Before each cycle.
  bool goes_on() noexcept {
    stopped_ = stopped_ || stop_();
    return !stopped_ && !silent_;
  }
  /// A standing angle, or a tacho that is not followed, does not end the looking.
  bool answers() const noexcept {
    const Fault found = rig_.fault();
    return found == Fault::none || found == rt::kEncoderStuck;
  }
  template <class Loop>
  rt::CycleRecord cycle(Loop& loop) noexcept {
    const rt::CycleRecord r = loop.cycle();
    rest_.see(rig_.board());
    silent_ = silence_.too_long(rig_.board().tick, time_.now());
    return r;
  }
  /// The first cycles of a loop, in which the rig learns which samples belong together.
  template <class Loop>
  void settle(const IoSettings& io, Loop& loop) noexcept {
    for (int k = 0; k < io.settle && (k < 10 || answers()) && goes_on(); ++k) cycle(loop);
  }
  template <class Loop>
  void watch_rest(Loop& loop) noexcept {
    while (!rest_.enough() && answers() && goes_on()) cycle(loop);
  }
  const RestWatch& rest() const noexcept { return rest_; }
  bool stopped() const noexcept { return stopped_; }
  bool silent() const noexcept { return silent_; }

 private:
  rt::HardwareRig& rig_;
  StopRequest stop_;
  rt::WallTime time_;
  BoardSilence silence_;
  RestWatch rest_;
  bool stopped_ = false, silent_ = false;
};

}  // namespace whirl::hardware
