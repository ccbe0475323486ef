// Ten million bytes of noise and of damaged frames: what is accepted is what was sent. The distance sent is a function
// of the frame's number, so that a frame put together from pieces is told from a true one.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>
#include <utility>

#include "whirl/rt/drivers/optoncdt.hpp"

namespace whirl::rt::optoncdt {
namespace {

/// A line with a sensor at one end and a decoder at the other.
class Line {
 public:
  explicit Line(int values) : length_(3 * static_cast<std::uint64_t>(values)), decoder_(values, values == 2 ? 1 : -1) {}

  std::uint32_t truth(std::uint64_t frame) const {  // jumps of the upper bits are frequent
    return static_cast<std::uint32_t>((frame & kValueMask) * 2654435761u >> 7) % 65521;
  }
  /// Byte `place` of the stream, with every place in its turn.
  std::uint8_t sent(std::uint64_t place) {
    number_ = place / length_;
    const bool first = place % length_ < 3;
    return encode({first ? truth(number_) : static_cast<std::uint32_t>(number_) & kValueMask, first})[place % 3];
  }
  /// `changed`: not the byte that was sent there, which nobody can see as long as it keeps its class.
  void push(std::uint8_t byte, bool changed = false) {
    line_[at_++ % line_.size()] = {byte, changed};
    Frame frame;
    if (!decoder_.push(byte, frame)) return;
    ++accepted;
    const auto right = encode({truth(length_ == 6 ? frame.raw[1] : number_), true});
    for (std::uint64_t i = 0; i < 3; ++i) {
      const auto [got, was_changed] = line_[(at_ - length_ + i) % line_.size()];
      if (got != right[i] && !was_changed) {
        ++wrong;
        break;
      }
    }
  }
  std::uint64_t bytes() const { return at_; }
  std::uint64_t length() const { return length_; }
  const LineStatistics& statistics() const { return decoder_.statistics(); }

  std::uint64_t accepted = 0, wrong = 0;

 private:
  std::uint64_t length_;
  FrameDecoder decoder_;
  std::array<std::pair<std::uint8_t, bool>, 16> line_{};
  std::uint64_t at_ = 0, number_ = 0;
};

// Bursts of noise of 1 to 64 bytes, also of bytes that look like text or like the right class, between runs of frames.
TEST(OptoncdtNoiseProperty, NothingWrongIsAcceptedAroundBurstsOfNoise) {
  std::mt19937_64 random(2024);
  Line line(2);
  std::uint64_t place = 0, whole_runs = 0;
  while (line.bytes() < 4'000'000) {
    const std::uint64_t length = 1 + random() % 64, kind = random() % 3;
    for (std::uint64_t i = 0; i < length; ++i) {
      const auto any = static_cast<std::uint8_t>(random());
      const auto in_order =
          static_cast<std::uint8_t>((std::array<unsigned, 6>{0, 0x40, 0x80, 0, 0x40, 0xc0})[i % 6] | (any & 0x3f));
      line.push(kind == 0 ? any : kind == 1 ? any & 0x7f : in_order);
    }
    const std::uint64_t frames = 1 + random() % 8;
    const std::uint64_t before = line.accepted;
    for (std::uint64_t i = 0; i < frames * line.length(); ++i, ++place) line.push(line.sent(place));
    // Noise that passes for the start of a frame costs the first, the gap the second at most.
    if (frames < 3) continue;
    ++whole_runs;
    EXPECT_GE(line.accepted - before, frames - 2);
  }
  EXPECT_EQ(line.wrong, 0u);
  EXPECT_GT(whole_runs, 30000u);
}

/// Bytes changed, lost (also whole frames) and put in: at least `quiet` good bytes between two incidents, then with the
/// chance 1 / `rarely` at each.
Line damaged(std::uint64_t quiet, std::uint64_t rarely, std::uint64_t bytes) {
  std::mt19937_64 random(quiet + rarely);
  Line line(2);
  std::uint64_t good = 0;
  for (std::uint64_t place = 0; line.bytes() < bytes; ++place) {
    if (++good > quiet && random() % rarely == 0) {
      good = 0;
      const std::uint64_t much = 1 + (random() % 4 == 0 ? random() % 30 : random() % 3);
      switch (random() % 3) {
        case 0:
          line.push(static_cast<std::uint8_t>(random()), true);
          continue;
        case 1:
          place += much;
          break;
        default:
          for (std::uint64_t i = 0; i < much; ++i) line.push(static_cast<std::uint8_t>(random()));
      }
    }
    line.push(line.sent(place));
  }
  return line;
}

TEST(OptoncdtNoiseProperty, NothingWrongIsAcceptedFromDamagedFrames) {
  const Line dense = damaged(12, 3, 2'000'000), rare = damaged(12, 90, 2'000'000);
  EXPECT_EQ(dense.wrong, 0u);
  EXPECT_GT(dense.statistics().resyncs, 50000u);
  EXPECT_EQ(rare.wrong, 0u);
  // Not by accepting nothing: with one incident in a hundred bytes most frames come through.
  EXPECT_GT(6 * rare.accepted, rare.bytes() / 2);
  // Incidents inside one frame can hide each other, such as a loss and a count changed to fit: once in millions.
  const Line together = damaged(0, 20, 3'000'000);
  EXPECT_LE(together.wrong, 2u);
}

// Without a counter the order of the bytes alone shows one and two lost bytes and those that change their class.
TEST(OptoncdtNoiseProperty, WithoutACounterSmallLossesAreSeen) {
  std::mt19937_64 random(7);
  Line line(1);
  std::uint64_t quiet = 0;
  for (std::uint64_t place = 0; line.bytes() < 1'000'000; ++place) {
    if (++quiet < 4 || random() % 10 != 0) {
      line.push(line.sent(place));
      continue;
    }
    quiet = 0;
    const std::uint8_t byte = line.sent(place);
    switch (random() % 3) {
      case 0:
        break;  // lost
      case 1:
        ++place;  // two lost
        break;
      default:
        line.push(static_cast<std::uint8_t>(byte ^ (byte & 0x80 ? 0x80 : 0x40)), true);
    }
  }
  EXPECT_EQ(line.wrong, 0u);
  EXPECT_GT(3 * line.accepted, line.bytes() / 3);
}

}  // namespace
}  // namespace whirl::rt::optoncdt
