// Against the real libiio and the real iiod over a tree of files (testing/iio_tree.hpp).
#include "whirl/rt/drivers/iio_board.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <thread>

#include "whirl/rt/latest_value.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/loop/iio_tree.hpp"

namespace whirl::rt {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Waits for a reading as the loop does; nothing after five seconds, or when the board is lost.
std::optional<BoardReading> next(IioBoard& board) {
  BoardReading r;
  for (int i = 0; i < 50; ++i) {
    if (board.read(r)) return r;
    if (!board.connected()) return {};
    pollfd fd{board.descriptor(), POLLIN, 0};
    ::poll(&fd, 1, 100);
  }
  return {};
}
bool is_lost(const IioBoard& board) {
  for (int i = 0; i < 500 && board.connected(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return !board.connected();
}

struct IioBoardReference : ::testing::Test {
  void SetUp() override {
    if (const std::string why = testing::IioTree::missing(); !why.empty()) GTEST_SKIP() << why;
    tree.emplace();
    options.uri = tree->uri();
  }
  std::optional<testing::IioTree> tree;
  IioBoardOptions options{.input_device = "adc",
                          .output_device = "dac",
                          .inputs = {"voltage0", "voltage1", "", ""},
                          .outputs = {"voltage0", "voltage1"},
                          .angle = "count0",
                          .counts = 4096,
                          .watchdog = 2};
};

TEST_F(IioBoardReference, SamplesOfATriggeredBufferAreVoltsTicksAndAngle) {
  options.buffer = true;
  options.trigger = "hrtimer0";
  IioBoard board(options);
  EXPECT_EQ(tree->get("iio:device0/trigger/current_trigger"), "hrtimer0");
  EXPECT_EQ(std::stod(tree->get("trigger0/sampling_frequency")), 1000);
  tree->sample(-2000, -300, 65534, 1'000'000'000);
  auto r = next(board);
  ASSERT_TRUE(r);
  EXPECT_NEAR(r->analog[0], -1, 1e-12);
  EXPECT_NEAR(r->analog[1], 5e-3 * (-300 + 10), 1e-12);
  EXPECT_EQ(r->analog[2], 0);
  EXPECT_EQ(r->beta, 0);
  const std::uint32_t first = r->tick;
  tree->sample(2000, 300, 1022, 1'005'000'100);  // its count wraps after 65535; five ticks later
  r = next(board);
  ASSERT_TRUE(r);
  EXPECT_NEAR(r->analog[0], 1, 1e-12);
  EXPECT_NEAR(r->analog[1], 5e-3 * 310, 1e-12);
  EXPECT_NEAR(r->beta, std::numbers::pi / 2, 1e-12);
  EXPECT_EQ(r->tick - first, 5u);
}

TEST_F(IioBoardReference, ChannelsAskedOneByOneInTheirOwnOrAGivenScale) {
  options.sample_time = 5e-3;
  tree->set("iio:device0/in_voltage0_raw", "1000");
  tree->set("iio:device0/in_voltage1_raw", "-110");
  tree->set("iio:device0/in_count0_raw", "100");
  {
    IioBoard board(options);
    auto r = next(board);
    ASSERT_TRUE(r);
    EXPECT_NEAR(r->analog[0], 0.5, 1e-12);
    EXPECT_NEAR(r->analog[1], -0.5, 1e-12);
    const std::uint32_t before = r->tick;
    tree->set("iio:device0/in_count0_raw", "1124");
    for (int i = 0; i < 100 && r && r->beta == 0; ++i) r = next(board);
    ASSERT_TRUE(r);
    EXPECT_NEAR(r->beta, std::numbers::pi / 2, 1e-12);
    EXPECT_GT(r->tick, before);
  }
  options.input_scale = 2e-3;
  options.input_offset = -500;
  options.inputs = {"voltage2", "", "", ""};  // states no scale
  tree->set("iio:device0/in_voltage2_raw", "1000");
  IioBoard board(options);
  const auto r = next(board);
  ASSERT_TRUE(r);
  EXPECT_NEAR(r->analog[0], 1, 1e-12);
}

TEST_F(IioBoardReference, OutputsFollowCommandsAndAreLeftAtZero) {
  {
    IioBoard board(options);
    EXPECT_EQ(tree->get("iio:device1/out_voltage0_raw"), "32768") << "zero from the beginning";
    board.write({{2.5, -10}, 11, true, true});
    // 20 V over 65536 counts, 32768 is zero.
    EXPECT_TRUE(tree->becomes("iio:device1/out_voltage0_raw", "40960"));
    EXPECT_TRUE(tree->becomes("iio:device1/out_voltage1_raw", "0"));
    std::optional<BoardReading> r;
    for (int i = 0; i < 100; ++i) {
      r = next(board);
      if (!r || r->output) break;
    }
    ASSERT_TRUE(r);
    EXPECT_TRUE(r->output);
    EXPECT_EQ(r->answered, 11u);
    board.write({{2.5, 2.5}, 12, false, false});
    EXPECT_TRUE(tree->becomes("iio:device1/out_voltage0_raw", "32768")) << "disarmed";
    EXPECT_TRUE(tree->becomes("iio:device1/out_voltage1_raw", "32768"));
    board.write({{5, 5}, 13, true, true});
    EXPECT_TRUE(tree->becomes("iio:device1/out_voltage0_raw", "49152"));
  }
  EXPECT_EQ(tree->get("iio:device1/out_voltage0_raw"), "32768") << "closed";
  EXPECT_EQ(tree->get("iio:device1/out_voltage1_raw"), "32768");
}

TEST_F(IioBoardReference, WithoutCommandsTheOutputsFallToZeroUntilDisarmed) {
  options.watchdog = 50e-3;
  IioBoard board(options);
  board.write({{5, 5}, 1, true, true});
  EXPECT_TRUE(tree->becomes("iio:device1/out_voltage0_raw", "49152") ||
              tree->get("iio:device1/out_voltage0_raw") == "32768");
  EXPECT_TRUE(tree->becomes("iio:device1/out_voltage0_raw", "32768"));
  const auto expired = [&] {
    const auto r = next(board);
    return r && r->expired;
  };
  for (int i = 0; i < 200 && !expired(); ++i) {
  }
  EXPECT_TRUE(expired());
  board.write({{5, 5}, 2, true, true});
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(tree->get("iio:device1/out_voltage0_raw"), "32768") << "latched";
  board.write({{5, 5}, 3, false, false});
  for (int i = 0; i < 200 && expired(); ++i) {
  }
  EXPECT_FALSE(expired());
}

TEST_F(IioBoardReference, AFailedInputLosesTheBoardAndTakesTheForceAway) {
  IioBoard board(options);
  EXPECT_TRUE(next(board));
  EXPECT_EQ(board.failure(), "");
  board.write({{5, 5}, 1, true, true});
  EXPECT_TRUE(tree->becomes("iio:device1/out_voltage1_raw", "49152"));
  tree->remove("iio:device0/in_voltage1_raw");
  EXPECT_TRUE(is_lost(board));
  EXPECT_EQ(board.loss(), kBoardLost);
  EXPECT_THAT(board.failure(), AllOf(HasSubstr("reading an input"), HasSubstr(options.uri)));
  EXPECT_TRUE(tree->becomes("iio:device1/out_voltage0_raw", "32768"));
  EXPECT_TRUE(tree->becomes("iio:device1/out_voltage1_raw", "32768"));
  board.write({{5, 5}, 2, true, true});
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(tree->get("iio:device1/out_voltage1_raw"), "32768") << "for good";
}

TEST_F(IioBoardReference, AKilledDaemonIsALostBoardWithoutAnyWait) {
  for (const bool buffer : {true, false}) {
    options.buffer = buffer;
    IioBoard board(options);
    tree->sample(1, 1, 1, 1);
    EXPECT_TRUE(next(board));
    tree->kill();
    EXPECT_TRUE(is_lost(board));
    EXPECT_THAT(board.failure(), HasSubstr(buffer ? "reading the buffer" : "reading an input"));
    tree.emplace();
    options.uri = tree->uri();
  }
}

TEST_F(IioBoardReference, WhatIsNotThereIsNamedWithWhatIs) {
  const auto refusal = [this](auto change) {
    IioBoardOptions o = options;
    change(o);
    return testing::error_of([&] { IioBoard{o}; });
  };
  using O = IioBoardOptions;
  EXPECT_THAT(refusal([](O& o) { o.uri = "ip:127.0.0.1:1"; }), HasSubstr("ip:127.0.0.1:1: Connection refused"));
  EXPECT_THAT(refusal([](O& o) { o.library = "libnowhere.so"; }), HasSubstr("libnowhere.so"));
  EXPECT_THAT(refusal([](O& o) { o.output_device = "dca"; }),
              AllOf(HasSubstr("iio.output_device = \"dca\""), HasSubstr("adc (iio:device0), dac (iio:device1)")));
  EXPECT_THAT(refusal([](O& o) { o.inputs[3] = "voltage7"; }),
              AllOf(HasSubstr("iio.input_3 = \"voltage7\": no such input channel of adc"), HasSubstr("voltage1")));
  EXPECT_THAT(refusal([](O& o) { o.outputs[1] = "voltage2"; }), HasSubstr("iio.output_y"));
  EXPECT_THAT(refusal([](O& o) { o.angle = "angl0"; }), HasSubstr("count0"));
  EXPECT_THAT(refusal([](O& o) { o.inputs[1] = "voltage2"; }), HasSubstr("set iio.input_scale_mV"));
  EXPECT_THAT(refusal([](O& o) { o.buffer = true, o.trigger = "timer"; }),
              HasSubstr("hrtimer0 (trigger0), fixed (trigger1)"));
  EXPECT_THAT(refusal([](O& o) { o.buffer = true, o.trigger = "fixed"; }), HasSubstr("sampling_frequency of fixed"));
  EXPECT_THAT(refusal([](O& o) { o.buffer = true, o.inputs[1] = "voltage2", o.input_scale = 1; }),
              HasSubstr("voltage2 is not in the device's buffer"));
  EXPECT_EQ(tree->get("iio:device0/trigger/current_trigger"), "") << "nothing was changed";
}

TEST(LatestValueRealtime, IsNeverTornAndNeverGoesBack) {
  struct Pair {
    std::uint64_t a = 0, b = 0;
  };
  LatestValue<Pair> value;
  Pair p;
  EXPECT_FALSE(value.take(p));
  constexpr std::uint64_t kLast = 200'000;
  std::thread producer([&] {
    for (std::uint64_t k = 1; k <= kLast; ++k) value.put({k, ~k});
  });
  std::uint64_t before = 0;
  while (before < kLast) {
    if (!value.take(p)) continue;
    ASSERT_EQ(p.b, ~p.a);
    ASSERT_GT(p.a, before);
    before = p.a;
  }
  producer.join();
  EXPECT_FALSE(value.take(p));
}

// At 100 kHz that is after half a day; the instants go on.
TEST(IioTimer, GoesOnAfterTheTicksOfTheBoardHaveWrapped) {
  constexpr std::int64_t kWrap = std::int64_t{1} << 32;
  IioTimer timer{500, 10'000};
  EXPECT_EQ(timer.wake(500 + (kWrap - 1) * timer.period + 70), 0xffffffffu);
  EXPECT_EQ(timer.next(), 500 + kWrap * timer.period);
  EXPECT_EQ(timer.wake(timer.next() + 1), 0u);
  EXPECT_EQ(timer.next(), 500 + (kWrap + 1) * timer.period) << "not in the past";
  EXPECT_EQ(timer.wake(timer.next() + 3 * timer.period), 4u) << "three were left out";
}

}  // namespace
}  // namespace whirl::rt
