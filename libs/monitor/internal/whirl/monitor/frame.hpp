#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>

namespace whirl::monitor {

/// One WebSocket message, shared by all clients.
struct Message {
  std::string data;
  bool text = false;  ///< JSON text; otherwise a binary frame
};
using MessagePtr = std::shared_ptr<const Message>;

/// Kinds of binary frames.
enum class FrameKind : std::uint32_t {
  samples = 1,      ///< every sample
  min_max = 2,      ///< smallest and largest of each group of 2^k samples, alternating
  decimated = 3,    ///< the first of each group of 2^k samples (orbit, phase plane)
  spectrum = 4,     ///< averaged amplitude, peak, line 0 at 0 Hz
  synchronous = 5,  ///< per revolution: speed (rad/s), its end (s after t_ns), then Re and Im of the 1X vector per
                    ///< tracked channel
  full_spectrum =
      6,          ///< averaged amplitude, peak, of x + j y: an odd number of lines, 0 Hz in the middle, backward first
  waterfall = 7,  ///< amplitude, peak, of the newest block of the first tracked channel; t_ns: its middle
};

/// Binary frame, little-endian, 20-byte header, then float32 values channel by channel (NaN marks a gap):
///
///   u32 magic  0x574D1000 | kind << 8 | k   "WM", version 1, kind, group size 2^k
///   u32 seq    number of the frame: a gap shows frames dropped for a slow client
///   u64 t_ns   stream time of the first sample, ns
///   u16 channels, u16 n   values per channel
std::string encode_frame(FrameKind kind, unsigned log2_group, std::uint32_t seq, double t_first,
                         const Eigen::Ref<const Eigen::MatrixXd>& values);

/// Header of a frame as decoded (tests, other clients).
struct FrameHeader {
  FrameKind kind = FrameKind::samples;
  unsigned log2_group = 0;
  std::uint32_t seq = 0;
  std::uint64_t t_ns = 0;
  unsigned channels = 0, n = 0;
};
/// Throws Error when the bytes are not a frame of this version or its length does not fit.
FrameHeader decode_frame(const std::string& bytes, Eigen::MatrixXf* values = nullptr);

}  // namespace whirl::monitor
