// The loop on converters behind a real iiod (testing/iio_tree.hpp), with the io.toml of the examples.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <sstream>
#include <thread>

#include "whirl/core/error.hpp"
#include "whirl/hardware/realtime_run.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/loop/iio_tree.hpp"
#include "whirl/testing/paths.hpp"

namespace whirl::hardware {
namespace {

using ::testing::HasSubstr;

constexpr const char* kZero = "32768";  // counts of the tree's output at 0 V

/// The file of the examples with the names of the tree in place of the boards'.
std::string example(const std::string& uri) {
  std::ifstream in(testing::source_dir() + "/examples/08_realtime/io_iio.toml");
  std::ostringstream all;
  all << in.rdbuf();
  std::string text = all.str() + "watchdog_ms = 2000\n";  // whatever the machine is busy with
  const auto replace = [&text](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::runtime_error(from);
    text.replace(at, from.size(), to);
  };
  replace("address = \"local:\"", "address = \"" + uri + "\"");
  replace("input_device = \"ad7606\"", "input_device = \"adc\"");
  replace("output_device = \"ad5754r\"", "output_device = \"dac\"");
  replace("angle_device = \"ad2s1210\"", "angle_device = \"adc\"");
  replace("angle = \"angl0\"", "angle = \"count0\"");
  return text;
}

ControllerDesign design() {
  ControllerDesign d;
  d.law = "pd";
  d.estimator = "lpf";
  d.model.k1 = 5600;
  d.model.c = 1;
  d.model.gain = 1 / 1.5;
  d.force_limit = 40;
  d.feedforward = false;
  return d;
}

/// Whirl of 1 mm at 60 rad/s, until it is told to end. By their time stamps the samples are a millisecond apart; they
/// come more slowly, so that a busy machine leaves no long gap.
class Whirling {
 public:
  explicit Whirling(const testing::IioTree& tree)
      : thread_([this, &tree] {
          // 4 to 20 mA over 250 ohm for 25 mm: 160 mV a mm, 3 V in the middle.
          const auto millivolts = [](double mm) { return 3000 + 160 * mm; };
          for (std::int64_t k = 0; !over_; ++k) {
            const double angle = 0.06 * static_cast<double>(k);
            tree.sample(static_cast<int>(std::lround(millivolts(std::cos(angle)) / 0.5)),
                        static_cast<int>(std::lround(millivolts(std::sin(angle)) / 5 - 10)),
                        static_cast<unsigned>(std::llround(angle * 65536 / (2 * std::numbers::pi))), 1'000'000 * k);
            std::this_thread::sleep_for(std::chrono::milliseconds(4));
          }
        }) {}
  ~Whirling() { end(); }
  void end() {
    over_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  std::atomic<bool> over_{false};
  std::thread thread_;
};

struct IioLoopE2e : ::testing::Test {
  void SetUp() override {
    if (const std::string why = testing::IioTree::missing(); !why.empty()) GTEST_SKIP() << why;
    tree.emplace();
    whirling.emplace(*tree);
    folder.write("io.toml", example(tree->uri()));
  }
  /// Runs until it trips; `event` comes after 200 cycles with force.
  RealtimeRun run(const std::function<void()>& event) {
    long cycles = 0;
    RealtimeRunOptions options;
    options.seconds = 60;
    options.take = [&](const rt::LoopSample& s) {
      largest = std::max(largest, std::abs(s.ux));
      speed = s.omega;
      if (++cycles == 200) event();
    };
    return run_realtime(design(), read_io(folder.path() / "io.toml"), options);
  }
  bool at_zero() const {
    return tree->becomes("iio:device1/out_voltage0_raw", kZero) && tree->becomes("iio:device1/out_voltage1_raw", kZero);
  }
  std::optional<testing::IioTree> tree;
  std::optional<Whirling> whirling;
  testing::TemporaryFolder folder;
  double largest = 0, speed = 0;
};

TEST_F(IioLoopE2e, AKilledDaemonEndsTheRunWithItsOwnReason) {
  const RealtimeRun r = run([this] {
    EXPECT_NE(tree->get("iio:device1/out_voltage0_raw"), kZero);
    tree->kill();
  });
  EXPECT_TRUE(r.loop.armed);
  EXPECT_GT(largest, 1) << "there was a force";
  EXPECT_NEAR(speed, 60, 5);
  EXPECT_EQ(r.loop.trip, rt::kBoardLost) << r.loop.reason;
  EXPECT_EQ(r.loop.reason, "trip: board_lost");
  EXPECT_EQ(r.summary.status, Status::unusable);
  ASSERT_EQ(r.summary.warnings.size(), 2u);
  EXPECT_THAT(r.summary.warnings[1], HasSubstr("board iio " + tree->uri()));
}

TEST_F(IioLoopE2e, AKilledDaemonEndsARecordingToo) {
  RealtimeRunOptions options;
  options.seconds = 60;
  options.record = folder.path() / "record.h5";
  long rows = 0;
  options.take = [&](const rt::LoopSample&) {
    if (++rows == 100) tree->kill();
  };
  const RecordRun r = record_disarmed(read_io(folder.path() / "io.toml"), options);
  EXPECT_EQ(r.loop.reason, "the board does not answer");
  EXPECT_GE(r.cycles, 100);
  EXPECT_EQ(r.summary.status, Status::unusable);
  ASSERT_EQ(r.summary.warnings.size(), 2u);
  EXPECT_THAT(r.summary.warnings[1], HasSubstr("board iio " + tree->uri()));
}

TEST_F(IioLoopE2e, SamplesThatStayAwayAreTheWatchdogsAndTheForceIsZero) {
  const RealtimeRun r = run([this] { whirling->end(); });
  EXPECT_EQ(r.loop.trip, Fault::watchdog) << r.loop.reason;
  EXPECT_TRUE(at_zero());
}

TEST_F(IioLoopE2e, ALostAngleTakesTheForceAway) {
  const std::string io = example(tree->uri());
  // The angle is a device of its own, asked at each sample.
  folder.write("io.toml",
               std::string(io).replace(io.find("angle_device = \"adc\""), 20, "angle_device = \"iio:device0\""));
  const RealtimeRun r = run([this] { tree->remove("iio:device0/in_count0_raw"); });
  EXPECT_EQ(r.loop.trip, rt::kBoardLost) << r.loop.reason;
  EXPECT_THAT(r.summary.warnings.back(), HasSubstr("reading the angle"));
  EXPECT_TRUE(at_zero());
}

TEST(IioSettings, WhatCannotBeIsRefused) {
  const testing::TemporaryFolder folder;
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string text = example("local:");
    if (!from.empty()) text.replace(text.find(from), from.size(), to);
    folder.write("io.toml", text);
    return testing::error_of([&] { read_io(folder.path() / "io.toml"); });
  };
  EXPECT_EQ(refusal("", ""), "no error");
  EXPECT_THAT(refusal("clock = \"sample\"", "clock = \"lockstep\""), HasSubstr("loop.clock"));
  EXPECT_THAT(refusal("output_y = \"voltage1\"", "output_y = \"\""), HasSubstr("iio.output_y"));
  EXPECT_THAT(refusal("buffer = true", "buffer = false"), HasSubstr("iio.trigger"));
  EXPECT_THAT(refusal("input_1 = \"voltage1\"", ""), HasSubstr("iio.input_1"));
  EXPECT_THAT(refusal("angle_bits = 16", "angle_bits = 33"), HasSubstr("iio.angle_bits"));
  EXPECT_THAT(refusal("driver = \"iio\"", "driver = \"ioo\""), HasSubstr("iio"));
}

}  // namespace
}  // namespace whirl::hardware
