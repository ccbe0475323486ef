#include "whirl/rt/drivers/optoncdt.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "whirl/core/error.hpp"

namespace whirl::rt::optoncdt {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& to, std::uint32_t raw, bool first = true) {
  const auto bytes = encode({raw, first});
  to.insert(to.end(), bytes.begin(), bytes.end());
}

std::vector<Frame> frames(FrameDecoder& decoder, const Bytes& bytes) {
  std::vector<Frame> out;
  decoder.feed(bytes, [&](const Frame& f) { out.push_back(f); });
  return out;
}

TEST(Optoncdt, BytesOfAValueCarryTheirPlace) {
  EXPECT_EQ(encode({0x2A5C3, true}), (std::array<std::uint8_t, 3>{0x03, 0x40 | 0x17, 0x80 | 0x2A}));
  EXPECT_EQ(encode({0x2A5C3, false})[2], 0xC0 | 0x2A);
  ValueDecoder d;
  Value v;
  EXPECT_FALSE(d.push(0x03, v));
  EXPECT_FALSE(d.push(0x57, v));
  EXPECT_TRUE(d.push(0xAA, v));
  EXPECT_EQ(v.raw, 0x2A5C3u);
  EXPECT_TRUE(v.first);
}

// Operating instructions ILD1420: one step is 0.156 um at a range of 10 mm; d = 0 and d = range at the ends
// of the range.
TEST(OptoncdtReference, ScaleOfTheManual) {
  const Scale scale(0.010);
  EXPECT_NEAR(scale.resolution(), 0.156e-6, 0.001e-6);
  EXPECT_NEAR(scale(643).distance, 0, scale.resolution());
  EXPECT_NEAR(scale(64877).distance, 0.010, scale.resolution());
  EXPECT_NEAR(scale(32760).distance, 0.005, scale.resolution());
  EXPECT_DOUBLE_EQ(scale(0).distance, -0.0001);
  EXPECT_DOUBLE_EQ(scale(65520).distance, 0.0101);
  EXPECT_FALSE(scale(642).in_range);
  EXPECT_TRUE(scale(643).in_range);
  EXPECT_TRUE(scale(64877).in_range);
  EXPECT_FALSE(scale(64878).in_range);
  const Scale mastered(0.010, true);
  EXPECT_NEAR(mastered(32760).distance, 0, 1e-12);
  EXPECT_GT(mastered(70000).distance, 0.005);
  EXPECT_THROW(Scale(0.02), Error);
}

TEST(OptoncdtReference, AnErrorIsNeverADistance) {
  for (const bool mastering : {false, true}) {
    const Scale scale(0.025, mastering);
    for (std::uint32_t raw = 262072; raw <= kValueMask; ++raw) {
      const Reading r = scale(raw);
      EXPECT_NE(r.error, SensorError::none) << raw;
      EXPECT_TRUE(std::isnan(r.distance)) << raw;
      EXPECT_FALSE(r.in_range) << raw;
    }
    EXPECT_EQ(scale(262075).error, SensorError::too_much_data);
    EXPECT_EQ(scale(262076).error, SensorError::no_peak);
    EXPECT_EQ(scale(262077).error, SensorError::peak_before_range);
    EXPECT_EQ(scale(262078).error, SensorError::peak_behind_range);
    EXPECT_EQ(scale(262079).error, SensorError::unknown_code);
    EXPECT_EQ(scale(262080).error, SensorError::not_calculable);
    EXPECT_EQ(scale(262081).error, SensorError::peak_too_large);
    EXPECT_EQ(scale(262082).error, SensorError::laser_off);
  }
  EXPECT_EQ(Scale(0.025)(65521).error, SensorError::no_distance);
  EXPECT_EQ(Scale(0.025, true)(65521).error, SensorError::none);
  // The trap: 16 bits of "no peak" would be 10.09 mm of a 10 mm sensor.
  EXPECT_NEAR(Scale(0.010)(262076 & 0xffff).distance, 10.09e-3, 1e-5);
}

TEST(OptoncdtProperty, EveryValueSurvivesTheLine) {
  for (std::uint32_t raw = 0; raw <= kValueMask; ++raw) {
    for (const bool first : {true, false}) {
      ValueDecoder d;
      Value v;
      const auto bytes = encode({raw, first});
      ASSERT_FALSE(d.push(bytes[0], v));
      ASSERT_FALSE(d.push(bytes[1], v));
      ASSERT_TRUE(d.push(bytes[2], v));
      ASSERT_EQ(v.raw, raw);
      ASSERT_EQ(v.first, first);
    }
  }
}

TEST(Optoncdt, AdditionalValuesStayWithTheirDistance) {
  Bytes line;
  for (std::uint32_t k = 0; k < 3; ++k) {
    append(line, 1000 + k);
    append(line, k, false);
    append(line, 500, false);
  }
  FrameDecoder d(3);
  const auto got = frames(d, line);
  ASSERT_EQ(got.size(), 3u);
  EXPECT_EQ(got[2].raw[0], 1002u);
  EXPECT_EQ(got[2].raw[1], 2u);
  EXPECT_EQ(got[2].raw[2], 500u);
  EXPECT_EQ(d.statistics().dropped, 0u);
  EXPECT_EQ(d.statistics().incomplete, 0u);
}

TEST(Optoncdt, AFrameCountsOnlyWhenItFollowsAWholeOne) {
  Bytes line;
  append(line, 1);
  append(line, 11, false);
  append(line, 2);  // its additional value is lost
  append(line, 3);
  append(line, 13, false);
  append(line, 4);
  append(line, 14, false);
  append(line, 24, false);  // one too many
  append(line, 5);
  append(line, 15, false);
  append(line, 6);
  append(line, 16, false);
  FrameDecoder d(2);
  const auto got = frames(d, line);
  ASSERT_EQ(got.size(), 3u);
  EXPECT_EQ(got[0].raw[0], 1u);
  EXPECT_EQ(got[1].raw[0], 4u);
  EXPECT_EQ(got[2].raw[1], 16u);
  EXPECT_EQ(d.statistics().incomplete, 2u);
  EXPECT_EQ(d.statistics().unconfirmed, 2u);
}

// Bytes that vanish from the middle of one frame to the same place of the next leave an unbroken order: the counter
// tells.
TEST(Optoncdt, AGapInTheCounterIsAGap) {
  for (const bool with_counter : {true, false}) {
    Bytes line;
    for (std::uint32_t k = 0; k < 6; ++k) {
      append(line, 0x0fc0 + k * 0x0050);
      append(line, k, false);
    }
    line.erase(line.begin() + 3 * 6 + 2, line.begin() + 4 * 6 + 2);  // low 12 bits of frame 3, the rest of frame 4
    FrameDecoder d(2, with_counter ? 1 : -1);
    const auto got = frames(d, line);
    long wrong = 0;
    for (const Frame& f : got) wrong += f.raw[0] != 0x0fc0 + f.raw[1] * 0x0050;
    EXPECT_EQ(wrong, with_counter ? 0 : 1);
    EXPECT_EQ(got.size(), with_counter ? 3u : 5u) << "frames 1, 2 and 5";
  }
}

TEST(OptoncdtProperty, EveryLostByteCostsItsFrameAndTheNext) {
  Bytes line;
  std::mt19937_64 random(5);
  std::vector<std::uint32_t> sent;
  for (int k = 0; k < 20; ++k) {
    sent.push_back(static_cast<std::uint32_t>(random()) & 0xffff);
    append(line, sent.back());
  }
  for (std::size_t lost = 0; lost < line.size(); ++lost) {
    Bytes cut = line;
    cut.erase(cut.begin() + static_cast<std::ptrdiff_t>(lost));
    FrameDecoder d(1);
    const auto got = frames(d, cut);
    ASSERT_EQ(got.size(), std::max(sent.size() - 2, lost / 3)) << lost;
    for (std::size_t i = 0; i < got.size(); ++i) ASSERT_EQ(got[i].raw[0], sent[i < lost / 3 ? i : i + 2]) << lost;
    // Two bytes of the damaged value are left; at the end of the line they still wait for the third.
    EXPECT_EQ(d.statistics().dropped, lost + 1 == line.size() ? 0u : 2u);
  }
}

TEST(OptoncdtProperty, TextInTheStreamNeverBecomesAValue) {
  Bytes text;
  for (int c = 0; c < 128; ++c) {
    for (int e = 0; e < 128; ++e) {
      text.push_back(static_cast<std::uint8_t>(c));
      text.push_back(static_cast<std::uint8_t>(e));
    }
  }
  for (const char c : std::string_view("OUTPUT RS422\r\nE204 Received unsupported command\r\n->"))
    text.push_back(static_cast<std::uint8_t>(c));
  FrameDecoder d(1);
  EXPECT_TRUE(frames(d, text).empty());
  EXPECT_GT(d.statistics().resyncs, 0u);
  Bytes line;
  append(line, 776);
  append(line, 777);
  const auto got = frames(d, line);
  ASSERT_EQ(got.size(), 1u);
  EXPECT_EQ(got[0].raw[0], 777u);
}

// Each statistic counts its own event, and a sound line none.
TEST(Optoncdt, EveryBreakOfTheLineIsCountedOnce) {
  const auto count = [](const Bytes& line) {
    FrameDecoder d(1);
    (void)frames(d, line);
    return d.statistics();
  };
  Bytes sound;
  for (std::uint32_t k = 0; k < 4; ++k) append(sound, 100 + k);
  EXPECT_EQ(count(sound).resyncs, 0u);
  EXPECT_EQ(count(sound).incomplete, 0u);
  EXPECT_EQ(count(sound).frames, 4u);
  Bytes low_twice = sound;
  low_twice.insert(low_twice.begin() + 3, low_twice[3]);  // L L M H: one byte stands alone
  EXPECT_EQ(count(low_twice).resyncs, 1u);
  EXPECT_EQ(count(low_twice).dropped, 1u);
  Bytes without_middle = sound;
  without_middle.erase(without_middle.begin() + 4);  // L H: both go
  EXPECT_EQ(count(without_middle).resyncs, 1u);
  EXPECT_EQ(count(without_middle).dropped, 2u);
  Bytes stray = sound;
  stray.insert(stray.begin() + 3, 0x80);  // H between two values: no order was broken
  EXPECT_EQ(count(stray).resyncs, 0u);
  EXPECT_EQ(count(stray).dropped, 1u);
  EXPECT_EQ(count(stray).incomplete, 0u) << "no frame was begun";
  EXPECT_EQ(count(stray).unconfirmed, 1u);
}

TEST(Optoncdt, TheCounterMayStandFirst) {
  Bytes line;
  for (const std::uint32_t k : {1u, 2u, 5u, 6u}) {
    append(line, k);
    append(line, 100 + k, false);
  }
  FrameDecoder d(2, 0);
  const auto got = frames(d, line);
  ASSERT_EQ(got.size(), 2u) << "the first has no neighbour, 5 does not follow 2";
  EXPECT_EQ(got[0].raw[0], 2u);
  EXPECT_EQ(got[1].raw[0], 6u);
}

TEST(OptoncdtProperty, CountersOfTheLineAddUpOnNoise) {
  std::mt19937_64 random(11);
  for (int values = 1; values <= static_cast<int>(kMaxValues); ++values) {
    FrameDecoder d(values);
    Bytes noise(20000);
    for (auto& b : noise) b = static_cast<std::uint8_t>(random());
    std::uint64_t got = 0;
    d.feed(noise, [&](const Frame& f) {
      ++got;
      for (const std::uint32_t raw : f.raw) EXPECT_LE(raw, kValueMask);
    });
    const LineStatistics& s = d.statistics();
    EXPECT_EQ(s.bytes, noise.size());
    EXPECT_EQ(s.frames, got);
    EXPECT_LE(s.bytes - s.dropped - 3 * s.values, 2u);  // the rest is held for the value in progress
  }
}

TEST(Optoncdt, FeedingInPiecesGivesTheSameFrames) {
  Bytes line;
  for (std::uint32_t k = 0; k < 50; ++k) {
    append(line, 3 * k);
    append(line, k, false);
    if (k % 7 == 0) line.push_back(0xff);
  }
  FrameDecoder whole(2);
  const auto expected = frames(whole, line);
  for (std::size_t piece : {1u, 2u, 5u, 11u}) {
    FrameDecoder d(2);
    std::size_t count = 0;
    for (std::size_t i = 0; i < line.size(); i += piece) {
      d.feed(std::span(line).subspan(i, std::min(piece, line.size() - i)),
             [&](const Frame& f) { EXPECT_EQ(f.raw, expected[count++].raw); });
    }
    EXPECT_EQ(count, expected.size());
  }
}

TEST(Optoncdt, AdditionalQuantities) {
  EXPECT_EQ(lost_between(5, 6), 0u);
  EXPECT_EQ(lost_between(5, 9), 3u);
  EXPECT_EQ(lost_between(kValueMask, 0), 0u);
  EXPECT_EQ(lost_between(kValueMask - 1, 1), 2u);
  EXPECT_THROW(FrameDecoder(0), Error);
  EXPECT_THROW(FrameDecoder(9), Error);
  EXPECT_THROW(FrameDecoder(2, 2), Error);
}

}  // namespace
}  // namespace whirl::rt::optoncdt
