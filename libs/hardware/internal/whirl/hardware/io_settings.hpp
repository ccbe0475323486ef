#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "whirl/rt/drivers/hardware_rig.hpp"
#include "whirl/rt/drivers/iio_board.hpp"
#include "whirl/rt/drivers/vendor_boards.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/pace.hpp"
#include "whirl/rt/realtime.hpp"
#include "whirl/rt/safety.hpp"

namespace whirl::hardware {

/// Ticks of a served rig in lockstep after which what it shows before the start repeats itself; a loop is armed at a
/// multiple.
inline constexpr unsigned kLockstepCycle = 128;

/// A tacho on an analogue input of the board, in place of the board's own angle.
struct TachoSettings {
  int analog = -1;                 ///< input, 0 to 3; -1: none
  int pulses = 0, missing = -1;    ///< as signal::TachoOptions; 0 and -1: as its pulses show
  std::string edge = "automatic";  ///< or rising, falling, both
  double learn = 4;                ///< s before the run in which its marks are learned
};

/// What `whirl run --io`, `whirl record` and `whirl io` read from io.toml; the keys stand in docs/formats.md.
struct IoSettings {
  std::string source;            ///< file that they were read from
  std::string clock = "sample";  ///< "sample", "wall", or "lockstep": as sample, the recorded time is that of the ticks
  std::string overrun = "skip", dt = "fill";
  double rate = 1000;  ///< Hz
  int max_catch_up = 3, trip_after = 10;
  int settle = 100;  ///< disarmed cycles at the start
  rt::RealtimeOptions realtime;
  rt::SafetyLimits safety{.force = 0, .slew = 0, .displacement = 0, .stale = 0};
  double stale = 20e-3;     ///< s
  double watchdog = 50e-3;  ///< s without samples
  double release = 3;       ///< s in which the force fades after a trip
  std::string driver = "udp", address;
  std::string key_file;           ///< of a UDP board, relative to the folder of `source`; empty: no key
  rt::VendorBoardOptions vendor;  ///< of a board with the driver "comedi" or "quanser"
  rt::IioBoardOptions iio;        ///< with the driver "iio"; address, library and encoder are those of the board
  rt::HardwareOptions hardware;
  TachoSettings tacho;

  rt::PaceOptions pace() const;
  rt::LoopOptions loop() const;     ///< disarmed
  rt::SafetyLimits limits() const;  ///< with `stale` in ticks
  std::unique_ptr<rt::Board> board() const;
  std::int64_t watchdog_ns() const { return static_cast<std::int64_t>(1e9 * watchdog); }
};

/// Throws Error for unknown keys and values out of range.
IoSettings read_io(const std::filesystem::path& path);
std::string io_toml(const IoSettings& settings);

}  // namespace whirl::hardware
