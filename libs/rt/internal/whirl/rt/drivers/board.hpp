#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "whirl/rt/faults.hpp"

namespace whirl::rt {

/// What a converter board gives once per tick of its own clock.
struct BoardReading {
  std::uint32_t tick = 0;          ///< of the board's clock
  double beta = 0;                 ///< rotor angle, rad, continuous
  double omega = 0;                ///< rad/s
  double omega_dot = 0;            ///< rad/s^2
  std::array<double, 4> analog{};  ///< inputs, V
  std::uint32_t answered = 0;      ///< tick that the command acting now was computed from
  bool output = false;             ///< outputs follow the commands
  bool expired = false;       ///< the board's watchdog has set the outputs to zero; latched until a disarmed command
  bool done = false;          ///< the experiment is over
  std::uint16_t session = 0;  ///< another number after each start of the board; 0: it gives none
};

/// What the outputs shall do.
struct BoardCommand {
  std::array<double, 2> volts{};
  std::uint32_t answers = 0;  ///< tick of the reading it was computed from
  bool armed = false;         ///< false: outputs at zero; clears an expired watchdog
  bool start = false;         ///< start the experiment (virtual rig)
};

/// A converter board: UdpBoard, ComediBoard, QuanserBoard, IioBoard. Nothing here waits, throws or allocates. The
/// board, not this program, must set its outputs to zero when commands stay away (its watchdog).
class Board {
 public:
  virtual ~Board() = default;
  /// The newest reading; false when nothing new has come.
  virtual bool read(BoardReading& out) noexcept = 0;
  virtual void write(const BoardCommand& command) noexcept = 0;
  virtual bool connected() const noexcept = 0;
  /// To wait for with poll; -1 when the board has no clock of its own and is asked at each tick.
  virtual int descriptor() const noexcept { return -1; }
  /// Why to trip while it is not connected. kBoardLost: it is gone for good, and nothing has to be waited for.
  virtual Fault loss() const noexcept { return Fault::watchdog; }
  /// A board without a clock of its own is told before `read` how many ticks passed since the last one without a read.
  virtual void left_out(long) noexcept {}
  /// In words, what ended the connection; empty when the board has nothing to say. Not for the loop's thread.
  virtual std::string failure() const { return {}; }
};

}  // namespace whirl::rt
