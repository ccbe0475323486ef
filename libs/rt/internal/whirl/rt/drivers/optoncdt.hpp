#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

/// Serial protocol of the laser triangulation sensor optoNCDT ILD1420 (RS422, 8N1): bytes to distances. No
/// device access and no clock here: the same code reads a serial line, a log file and a simulator. Nothing
/// allocates or throws after construction.
///
/// A value is three bytes, lowest first; bits 7..6 say which byte it is (operating instructions ILD1420, data
/// protocol):
///
///     L 00 D5..D0     M 01 D11..D6     H 10 D17..D12 first value of a frame, 11 an additional value
///
/// Distances have 16 bits (18 with mastering), error codes 18: always decode 18 bits. The low 16 bits of the
/// error codes look like distances beyond the range.
namespace whirl::rt::optoncdt {

constexpr std::uint32_t kValueMask = (1u << 18) - 1;

/// One decoded value of 18 bits.
struct Value {
  std::uint32_t raw = 0;
  bool first = true;  ///< first of its frame, otherwise an additional one
};
/// The three bytes of a value; bits above 17 are ignored.
std::array<std::uint8_t, 3> encode(Value value) noexcept;

/// What came instead of a distance.
enum class SensorError : std::uint8_t {
  none = 0,
  too_much_data,      ///< 262075: more data than the baud rate carries
  no_peak,            ///< 262076
  peak_before_range,  ///< 262077
  peak_behind_range,  ///< 262078
  not_calculable,     ///< 262080
  peak_too_large,     ///< 262081
  laser_off,          ///< 262082
  unknown_code,       ///< another code from 262072 on
  no_distance,        ///< above the largest distance, but below the error codes
};
constexpr int kSensorErrors = 10;
std::string_view to_string(SensorError error);

/// A distance or an error, never both.
struct Reading {
  double distance = 0;  ///< m; NaN when `error` is set
  SensorError error = SensorError::none;
  bool in_range = false;  ///< inside the measuring range; false in its reserves at both ends
};

/// Conversion of one sensor. `range` in m: 0.01, 0.025, 0.05, 0.1, 0.2 or 0.5; throws Error otherwise.
class Scale {
 public:
  explicit Scale(double range, bool mastering = false);
  /// Without mastering d = (1.02 x / 65520 - 0.01) range for x <= 65520, measuring range 643..64877;
  /// with mastering d = (1.02 x / 65520 - 0.51) range, relative to the master.
  Reading operator()(std::uint32_t raw) const noexcept;
  double resolution() const noexcept;  ///< m per step

 private:
  double range_;
  bool mastering_;
};

/// Frames lost between two counter values (18 bits, wraps).
constexpr std::uint32_t lost_between(std::uint32_t previous, std::uint32_t current) noexcept {
  return (current - previous - 1) & kValueMask;
}

constexpr std::size_t kMaxValues = 8;  ///< of a frame: the distance and seven additional values

/// Values that belong to one measurement: `raw[0]` is the first, the rest in the order configured.
struct Frame {
  std::array<std::uint32_t, kMaxValues> raw{};
};

/// What happened on the line so far.
struct LineStatistics {
  std::uint64_t bytes = 0;
  std::uint64_t dropped = 0;  ///< bytes that belong to no value: noise, lost neighbours, ASCII replies
  std::uint64_t resyncs = 0;  ///< times the byte order broke
  std::uint64_t values = 0;
  std::uint64_t frames = 0;       ///< accepted
  std::uint64_t incomplete = 0;   ///< frames with too few or too many values: dropped
  std::uint64_t unconfirmed = 0;  ///< complete frames that follow a gap in bytes or counter: not accepted
};

/// Bytes to values: accepts only the order L, M, H and drops bytes up to the next L when it breaks. ASCII
/// text (bit 7 clear) never completes a value. The state is the object itself; copies continue independently.
class ValueDecoder {
 public:
  /// True when `byte` completes a value, which is then in `value`.
  bool push(std::uint8_t byte, Value& value) noexcept;
  const LineStatistics& statistics() const noexcept { return statistics_; }

 private:
  friend class FrameDecoder;
  std::array<std::uint8_t, 2> held_{};
  std::uint8_t have_ = 0;
  LineStatistics statistics_;
};

/// Bytes to frames of a fixed number of values.
///
/// Frames carry no check sum, and where bytes were lost or added the values around may be put together from two
/// frames or from noise. Therefore a frame is accepted only when it follows its predecessor directly: no byte
/// dropped between them and, with a counter among the values, its count one above. A gap costs one frame more.
///
/// Limits of the protocol: a byte changed into another of the same class is not seen; without a counter neither
/// are bytes lost in such a way that the order L, M, H stays intact, nor a byte put in before the last.
class FrameDecoder {
 public:
  /// `values_per_frame` 1 .. kMaxValues; `counter`: which of the values counts the frames, -1 for none. Throws
  /// Error otherwise.
  explicit FrameDecoder(int values_per_frame, int counter = -1);
  /// True when `byte` completes a frame, which is then in `frame`.
  bool push(std::uint8_t byte, Frame& frame) noexcept;
  /// Calls `sink(const Frame&)` for every frame completed by `bytes`.
  template <class Sink>
  void feed(std::span<const std::uint8_t> bytes, Sink&& sink) {
    Frame frame;
    for (const std::uint8_t byte : bytes) {
      if (push(byte, frame)) sink(static_cast<const Frame&>(frame));
    }
  }
  const LineStatistics& statistics() const noexcept { return values_.statistics_; }
  int values_per_frame() const noexcept { return expected_; }

 private:
  ValueDecoder values_;
  bool follows(const Frame& frame) noexcept;
  Frame current_;
  int expected_, counter_at_;
  int have_ = 0;      // values of the frame in progress
  bool gap_ = false;  // since the last complete frame
  std::uint32_t counter_ = 0;
  bool counted_ = false;
};

}  // namespace whirl::rt::optoncdt
