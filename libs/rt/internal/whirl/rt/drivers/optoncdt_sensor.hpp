#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "whirl/rt/drivers/optoncdt.hpp"

namespace whirl::rt::optoncdt {

struct SensorOptions {
  std::string device;            ///< serial device, e.g. /dev/ttyUSB0
  int baud = 921600;             ///< factory setting; at most 1 000 000
  double measuring_rate = 4000;  ///< Hz; 250 .. 8000
  double range = 0.010;          ///< m, of the sensor
  bool mastering = false;        ///< distances relative to the master
  /// Ask for the frame counter as an additional value: makes lost frames visible and times exact.
  bool counter = false;
  double timeout = 1;  ///< s, for each answer and for the first clean frames
};

/// One measurement.
struct Sample {
  Reading reading;
  /// Number of the measurement since the start. With the counter lost frames are counted too; without it they
  /// are unknown.
  std::uint64_t index = 0;
  std::uint32_t raw = 0;      ///< as it came, 18 bits
  std::uint32_t counter = 0;  ///< the sensor's own, 18 bits; 0 without
};

/// Laser on a serial line. The constructor opens the line, stops the output, sets the rate, starts the output
/// and demands eight frames in unbroken sequence; it throws Error naming the device, the command and the
/// answer. Linux only.
///
/// Latency by the manual of the predecessor is three measuring cycles (0.75 ms at 4 kHz; not confirmed for
/// the 1420). The arrival of bytes jitters: the time of a sample is index / measuring_rate, not the time of
/// `read`.
class Sensor {
 public:
  explicit Sensor(const SensorOptions& options);
  ~Sensor();
  Sensor(const Sensor&) = delete;
  Sensor& operator=(const Sensor&) = delete;

  /// Takes what has arrived, oldest first, never waits; returns the number of samples. Allocates nothing.
  std::size_t read(std::span<Sample> out) noexcept;
  /// To wait for with poll.
  int descriptor() const noexcept { return fd_; }
  /// False after the line failed (unplugged); `read` then returns 0.
  bool connected() const noexcept { return connected_; }
  const LineStatistics& statistics() const noexcept { return decoder_.statistics(); }
  std::uint64_t lost_frames() const noexcept { return lost_; }                     ///< 0 without the counter
  const std::vector<std::string>& warnings() const noexcept { return warnings_; }  ///< `W...` answers of the start-up

 private:
  void command(const std::string& text);
  void wait_for_frames();
  Sample accept(const Frame& frame) noexcept;

  SensorOptions options_;
  Scale scale_;
  FrameDecoder decoder_;
  int fd_ = -1;
  bool connected_ = false;
  std::uint64_t index_ = 0, lost_ = 0;
  std::uint32_t counter_ = 0;
  bool started_ = false;
  std::array<std::uint8_t, 1024> bytes_{};
  std::size_t begin_ = 0, end_ = 0;  // of the bytes read but not decoded
  std::vector<std::string> warnings_;
};

}  // namespace whirl::rt::optoncdt
