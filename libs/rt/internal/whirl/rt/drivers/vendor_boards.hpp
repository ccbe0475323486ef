#pragma once
#include <array>
#include <memory>
#include <string>

#include "whirl/rt/drivers/angle_tracker.hpp"
#include "whirl/rt/drivers/board.hpp"

namespace whirl::rt {

/// A board on this machine, behind its maker's library, which is loaded when the board is opened. Neither driver has
/// seen its board: they were written from the documentation and run against libraries that stand in for the real ones.
struct VendorBoardOptions {
  std::string library;                         ///< empty: libhil.so, libcomedi.so.0
  std::string card = "q8_usb";                 ///< Quanser: type of the card
  std::string device;                          ///< Quanser: number of the card; Comedi: device file
  std::array<unsigned, 4> inputs{0, 1, 2, 3};  ///< channels of BoardReading::analog, +-10 V
  std::array<unsigned, 2> outputs{0, 1};       ///< channels of x and y, +-10 V
  unsigned encoder = 0;                        ///< channel
  double counts = 4096;                        ///< of the encoder per turn; negative: it counts the other way round
  double bandwidth = 5;                        ///< of speed and acceleration, Hz
  double sample_time = 1e-3;                   ///< s between two reads
  double watchdog = 50e-3;                     ///< s
};

/// What both have: read once per cycle of the loop, which counts the ticks for the board. A failed transfer loses the
/// board for good (`loss`, `failure`).
class VendorBoard : public Board {
 public:
  bool connected() const noexcept override { return connected_; }
  void left_out(long ticks) noexcept override { ticks_ += ticks; }
  Fault loss() const noexcept override { return kBoardLost; }

 protected:
  explicit VendorBoard(const VendorBoardOptions& options)
      : options_(options), angle_(options.counts, options.bandwidth, options.sample_time) {}
  /// All of a reading but its analogue inputs.
  void count(std::int32_t encoder, BoardReading& out) noexcept;
  /// The first failure stays.
  void lose(const char* what, int code = 0) noexcept {
    if (connected_) failed_at_ = what, failed_code_ = code;
    connected_ = false;
  }

  VendorBoardOptions options_;
  AngleTracker angle_;
  long ticks_ = 1;  ///< from the last read to the next
  std::uint32_t tick_ = 0, answered_ = 0;
  const char* failed_at_ = "";
  int failed_code_ = 0;
  bool connected_ = true, expired_ = false, output_ = false;
};

/// Quanser board by the HIL API (libhil). Its watchdog sets the outputs to 0 V when commands stay away.
class QuanserBoard : public VendorBoard {
 public:
  /// Throws Error naming library or card and the code of the failing function.
  explicit QuanserBoard(const VendorBoardOptions& options);
  ~QuanserBoard() override;
  bool read(BoardReading& out) noexcept override;
  void write(const BoardCommand& command) noexcept override;
  std::string failure() const override;

 private:
  struct Api;
  std::unique_ptr<Api> api_;
};

/// Any board with a Comedi driver: first analogue input, output and counter subdevice, range 0 against ground. Comedi
/// has no watchdog: something else must take the force away when this program dies, such as the amplifier's enable
/// line.
class ComediBoard : public VendorBoard {
 public:
  /// Throws Error naming library or device and what is missing.
  explicit ComediBoard(const VendorBoardOptions& options);
  ~ComediBoard() override;
  bool read(BoardReading& out) noexcept override;
  void write(const BoardCommand& command) noexcept override;
  std::string failure() const override;

 private:
  struct Api;
  std::unique_ptr<Api> api_;
  int shift_ = 0;
};

}  // namespace whirl::rt
