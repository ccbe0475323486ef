#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "whirl/rt/drivers/board.hpp"

namespace whirl::rt {

/// Converters with a Linux IIO driver. Devices go by name or id ("ad7606", "iio:device0"), channels by id or name
/// ("voltage0"), as `iio_info` lists them.
struct IioBoardOptions {
  std::string library{};       ///< empty: libiio.so.0
  std::string uri = "local:";  ///< of the context; "ip:host" or "ip:host:port" for iiod
  std::string input_device{}, output_device{};
  std::string angle_device{};          ///< empty: the input device
  std::array<std::string, 4> inputs;   ///< channels of BoardReading::analog; empty: not used, 0 V
  std::array<std::string, 2> outputs;  ///< channels of x and y
  std::string angle{};                 ///< channel of an angle or a count
  bool buffer = false;    ///< samples come from the kernel's buffer; false: each channel is asked at each tick
  std::string trigger{};  ///< of the buffer; empty: the one that is set, or none
  double input_scale = 0, output_scale = 0;    ///< V a count; 0: what the device states
  double input_offset = 0, output_offset = 0;  ///< counts, used with a scale of ours: V = scale (count + offset)
  int angle_bits = 0;         ///< after which the count wraps; 0: what the device states, 32 when it does not
  double counts = 4096;       ///< of the angle per turn; negative: it counts the other way round
  double bandwidth = 5;       ///< of speed and acceleration, Hz
  double sample_time = 1e-3;  ///< s
  double watchdog = 50e-3;    ///< s without a command after which the outputs are set to 0 V
  int priority = 0;           ///< of its two threads (SCHED_FIFO); 0: ordinary scheduling
};

/// The timer of a board without a buffer: instants `start + n period` for ever, ns; a late one is left out.
struct IioTimer {
  std::int64_t start = 0, period = 1'000'000;
  std::int64_t ticks = 0;  ///< since the start; BoardReading::tick holds its lower 32 bits

  std::int64_t next() const noexcept { return start + (ticks + 1) * period; }
  /// At `now`, after `next()`.
  std::uint32_t wake(std::int64_t now) noexcept {
    ticks = (now - start) / period;
    return static_cast<std::uint32_t>(ticks);
  }
};

/// Any converters with a Linux IIO driver, here or behind an `iiod`, by libiio 0.24 (loaded when the board is opened).
/// Two threads of its own talk to the library, which may block: `read` and `write` only hand over the newest reading
/// and command. The board has a clock: the samples of its buffer (its timestamps when it has them), or a timer.
///
/// The watchdog is one of this program: when the program dies the outputs stay, so that something else must take the
/// force away, such as the amplifier's enable line. A failed transfer loses the board for good (`loss`, `failure`).
class IioBoard : public Board {
 public:
  /// Throws Error naming the context, device, channel or trigger that is not there, with what is there, an attribute
  /// that is missing, or a rate that the device does not take.
  explicit IioBoard(const IioBoardOptions& options);
  ~IioBoard() override;
  bool read(BoardReading& out) noexcept override;
  void write(const BoardCommand& command) noexcept override;
  bool connected() const noexcept override;
  int descriptor() const noexcept override;
  Fault loss() const noexcept override;
  std::string failure() const override;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace whirl::rt
