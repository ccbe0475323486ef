#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/monitor/frame.hpp"
#include "whirl/monitor/frame_source.hpp"

namespace whirl::monitor {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

Recording ramp(Index n) {
  Recording r;
  r.dt = 1e-3;
  r.t0 = 2;
  r.source = "ramp";
  r.add("x", Quantity::displacement, Eigen::VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1)));
  return r;
}

TEST(MonitorPlayback, DeliversWhatIsDueAtItsSpeed) {
  double now = 100;
  PlaybackSource source(ramp(1000), 2, false, [&] { return now; });
  MatrixXd block(4096, 1);
  double t = 0;
  EXPECT_EQ(source.read(block, t), 0);
  now += 0.1;  // 0.2 s of the recording
  ASSERT_EQ(source.read(block, t), 200);
  EXPECT_DOUBLE_EQ(t, 2);
  EXPECT_EQ(block(199, 0), 199);
  now += 0.05;
  ASSERT_EQ(source.read(block, t), 100);
  EXPECT_DOUBLE_EQ(t, 2.2);
  EXPECT_EQ(block(0, 0), 200);
  now += 100;
  EXPECT_EQ(source.read(block, t), 700);
  EXPECT_EQ(source.read(block, t), 0);
  EXPECT_EQ(source.status()[0].second, "ended");
}

TEST(MonitorPlayback, CommandsPauseSeekAndChangeSpeed) {
  double now = 0;
  PlaybackSource source(ramp(1000), 1, false, [&] { return now; });
  MatrixXd block(4096, 1);
  double t = 0;
  EXPECT_TRUE(source.command("pause", 0));
  now += 1;
  EXPECT_EQ(source.read(block, t), 0);
  EXPECT_TRUE(source.command("play", 0));
  EXPECT_TRUE(source.command("seek", 0.5));
  EXPECT_TRUE(source.command("speed", 10));
  now += 0.01;
  ASSERT_EQ(source.read(block, t), 100);
  EXPECT_EQ(block(0, 0), 500);
  EXPECT_THROW(source.command("speed", 0), Error);
  EXPECT_THROW(source.command("seek", 7), Error);
  EXPECT_FALSE(source.command("fly", 1));
}

TEST(MonitorPlayback, LoopContinuesInTime) {
  double now = 0;
  PlaybackSource source(ramp(1000), 1, true, [&] { return now; });
  MatrixXd block(4096, 1);
  double t = 0;
  now = 1.5;
  EXPECT_EQ(source.read(block, t), 1000);
  EXPECT_EQ(source.read(block, t), 0);  // the second pass starts now
  now += 0.1;
  EXPECT_EQ(source.read(block, t), 100);
  EXPECT_NEAR(t, 3, 1e-12);
}

TEST(MonitorRingSource, LostTicksBecomeRowsOfNaN) {
  SampleRing ring(1, 64);
  RingSource source({"loop", 1000, {{"x", Quantity::displacement}}}, ring);
  for (const std::uint64_t tick : {50, 51, 54}) {
    const double v = static_cast<double>(tick);
    ring.push(tick, &v);
  }
  MatrixXd block(32, 1);
  double t = 0;
  ASSERT_EQ(source.read(block, t), 5);
  EXPECT_DOUBLE_EQ(t, 0.05);
  EXPECT_EQ(block(1, 0), 51);
  EXPECT_TRUE(std::isnan(block(2, 0)) && std::isnan(block(3, 0)));
  EXPECT_EQ(block(4, 0), 54);
  // A long pause is not filled: the stream goes on at the tick that comes.
  const double v = 1e6;
  ring.push(1'000'000, &v);
  ASSERT_EQ(source.read(block, t), 1);
  EXPECT_DOUBLE_EQ(t, 1000);
  EXPECT_EQ(block(0, 0), 1e6);
}

TEST(MonitorFrame, RoundTripAndAlignment) {
  MatrixXd values(3, 2);
  values << 1, 4, 2, NAN, 3, -6.5;
  const std::string bytes = encode_frame(FrameKind::min_max, 5, 77, 1.25, values);
  ASSERT_EQ(bytes.size(), 20U + 24U);
  EXPECT_EQ(bytes.substr(0, 4), std::string("\x05\x12\x4D\x57", 4));
  Eigen::MatrixXf decoded;
  const FrameHeader h = decode_frame(bytes, &decoded);
  EXPECT_EQ(h.kind, FrameKind::min_max);
  EXPECT_EQ(h.log2_group, 5U);
  EXPECT_EQ(h.seq, 77U);
  EXPECT_EQ(h.t_ns, 1'250'000'000U);
  ASSERT_EQ(decoded.rows(), 3);
  EXPECT_EQ(decoded(2, 1), -6.5F);
  EXPECT_TRUE(std::isnan(decoded(1, 1)));
  EXPECT_THROW(decode_frame(bytes.substr(0, 30)), Error);
  EXPECT_THROW(decode_frame("nonsense"), Error);
}

}  // namespace
}  // namespace whirl::monitor
