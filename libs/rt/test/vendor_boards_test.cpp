// Against libraries that stand in for the makers' (test/fake).
#include "whirl/rt/drivers/vendor_boards.hpp"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::rt {
namespace {

using ::testing::HasSubstr;

/// The variables of a library that stands in.
class Fake {
 public:
  explicit Fake(const char* path) : handle_(::dlopen(path, RTLD_NOW | RTLD_LOCAL)) {}
  ~Fake() { ::dlclose(handle_); }
  Fake(const Fake&) = delete;
  Fake& operator=(const Fake&) = delete;
  template <class T>
  T* at(const char* name) const {
    return static_cast<T*>(::dlsym(handle_, name));
  }

 private:
  void* handle_;
};

TEST(AngleTrackerProperty, FollowsConstantAccelerationThroughTheWrapOfTheCounter) {
  constexpr double kH = 1e-3, kCounts = 4096, kSpeed = 150, kSlope = -12;
  AngleTracker tracker(kCounts, 5, kH);
  const double first = 2147483647.0 - 20000;  // wraps after five turns
  double worst = 0;
  for (int k = 0; k <= 5000; ++k) {
    const double t = kH * k, angle = (kSpeed + 0.5 * kSlope * t) * t;
    const double count = std::floor(first + angle * kCounts / (2 * std::numbers::pi));
    tracker.update(static_cast<std::int32_t>(static_cast<std::int64_t>(count)));
    if (k == 0) continue;
    ASSERT_NEAR(tracker.beta(), angle, 2 * std::numbers::pi / kCounts * 1.001) << k;
    if (t > 0.5) worst = std::max(worst, std::abs(tracker.omega() - (kSpeed + kSlope * t)));
  }
  EXPECT_LT(worst, 0.1);
  EXPECT_NEAR(tracker.omega_dot(), kSlope, 1.5);
}

// Ticks that were left out move the filter on by their time.
TEST(AngleTrackerProperty, FollowsThroughTicksLeftOut) {
  constexpr double kH = 1e-3, kCounts = 4096, kSpeed = 150, kSlope = -12;
  AngleTracker tracker(kCounts, 5, kH);
  double worst = 0;
  long gap = 1;
  for (long k = 0; k <= 5000; k += gap) {
    const double t = kH * static_cast<double>(k), angle = (kSpeed + 0.5 * kSlope * t) * t;
    tracker.update(static_cast<std::int32_t>(std::floor(angle * kCounts / (2 * std::numbers::pi))), gap);
    if (t > 1) worst = std::max(worst, std::abs(tracker.omega() - (kSpeed + kSlope * t)));
    gap = k % 700 == 0 ? 80 : k % 10 == 0 ? 4 : 1;
  }
  EXPECT_LT(worst, 0.4);
  EXPECT_NEAR(tracker.omega(), kSpeed + kSlope * 5, 0.4);
}

struct QuanserBoardTest : ::testing::Test {
  Fake fake{WHIRL_FAKE_HIL};
  double* input = fake.at<double>("fake_input");
  double* output = fake.at<double>("fake_output");
  std::int32_t* count = fake.at<std::int32_t>("fake_count");
  int* failing = fake.at<int>("fake_failing");
  int* expired = fake.at<int>("fake_expired");
  VendorBoardOptions options{
      .library = WHIRL_FAKE_HIL, .device = "0", .outputs = {2, 3}, .encoder = 1, .counts = -4096};
};

TEST_F(QuanserBoardTest, ReadsWritesAndLeavesZero) {
  output[2] = 5;
  {
    QuanserBoard board(options);
    EXPECT_EQ(output[2], 0);
    EXPECT_DOUBLE_EQ(*fake.at<double>("fake_timeout"), 50e-3);
    EXPECT_EQ(board.descriptor(), -1);
    BoardReading r;
    input[3] = 2.5;
    count[1] = 100;
    ASSERT_TRUE(board.read(r));
    EXPECT_EQ(r.tick, 1u);
    EXPECT_EQ(r.analog[3], 2.5);
    EXPECT_EQ(r.beta, 0);
    count[1] = 100 - 1024;
    ASSERT_TRUE(board.read(r));
    EXPECT_DOUBLE_EQ(r.beta, std::numbers::pi / 2);
    board.write({{1.5, -2}, 2, true, true});
    EXPECT_EQ(output[2], 1.5);
    EXPECT_EQ(output[3], -2);
    ASSERT_TRUE(board.read(r));
    EXPECT_TRUE(r.output);
    EXPECT_EQ(r.answered, 2u);
    board.write({{1.5, -2}, 3, false, false});
    EXPECT_EQ(output[2], 0) << "disarmed";
    board.write({{1.5, -2}, 4, true, true});
  }
  EXPECT_EQ(output[2], 0) << "closed";
  EXPECT_EQ(*fake.at<int>("fake_running"), 0);
  EXPECT_EQ(*fake.at<int>("fake_open"), 0);
}

TEST_F(QuanserBoardTest, AnExpiredWatchdogLatchesUntilDisarmed) {
  QuanserBoard board(options);
  BoardReading r;
  board.write({{1, 1}, 1, true, true});
  *expired = 1;
  board.write({{1, 1}, 2, true, true});
  ASSERT_TRUE(board.read(r));
  EXPECT_TRUE(r.expired);
  EXPECT_FALSE(r.output);
  EXPECT_EQ(output[2], 0);
  board.write({{1, 1}, 3, false, false});
  EXPECT_EQ(*expired, 0);
  board.write({{1, 1}, 4, true, true});
  ASSERT_TRUE(board.read(r));
  EXPECT_FALSE(r.expired);
  EXPECT_EQ(output[2], 1);
  *failing = 1;
  EXPECT_FALSE(board.read(r));
  EXPECT_FALSE(board.connected());
  *failing = 0;
}

TEST_F(QuanserBoardTest, AFailedTransferLosesTheBoardWithItsReason) {
  for (const bool reads : {true, false}) {
    QuanserBoard board(options);
    BoardReading r;
    EXPECT_EQ(board.failure(), "");
    *failing = 1;
    if (reads) {
      EXPECT_FALSE(board.read(r));
    } else {
      board.write({{1, 1}, 1, true, true});
    }
    *failing = 0;
    for (int k = 0; k < 100; ++k) board.read(r);
    EXPECT_FALSE(board.connected());
    EXPECT_EQ(board.loss(), kBoardLost);
    EXPECT_EQ(board.failure(), reads ? "quanser q8_usb 0: hil_read failed with code -1"
                                     : "quanser q8_usb 0: hil_write_analog failed with code -1");
    board.write({{1, 1}, 2, true, true});
    EXPECT_EQ(output[2], 0) << "no more force";
  }
}

TEST_F(QuanserBoardTest, WhatDoesNotOpenIsNamed) {
  options.device = "7";
  EXPECT_THAT(testing::error_of([&] { QuanserBoard{options}; }), HasSubstr("q8_usb 7: hil_open failed with code -15"));
  options.library = WHIRL_FAKE_COMEDI;
  EXPECT_THAT(testing::error_of([&] { QuanserBoard{options}; }), HasSubstr("has no function hil_open"));
  options.library = "libnowhere.so";
  EXPECT_THAT(testing::error_of([&] { QuanserBoard{options}; }), HasSubstr("libnowhere.so"));
}

struct ComediBoardTest : ::testing::Test {
  Fake fake{WHIRL_FAKE_COMEDI};
  unsigned* input = fake.at<unsigned>("fake_input");
  unsigned* output = fake.at<unsigned>("fake_output");
  unsigned* count = fake.at<unsigned>("fake_count");
  VendorBoardOptions options{.library = WHIRL_FAKE_COMEDI, .device = "/dev/comedi0", .counts = 4096};
  static double volts(unsigned data) { return -10 + 20.0 * data / 65535; }
};

TEST_F(ComediBoardTest, ReadsWritesAndLeavesZero) {
  output[0] = 0;
  {
    ComediBoard board(options);
    EXPECT_NEAR(volts(output[0]), 0, 2e-4);
    BoardReading r;
    input[2] = 49151;
    count[0] = 0xfffffe;  // two below the wrap of its 24 bits
    ASSERT_TRUE(board.read(r));
    EXPECT_NEAR(r.analog[2], 5, 1e-3);
    count[0] = 1022;
    ASSERT_TRUE(board.read(r));
    EXPECT_DOUBLE_EQ(r.beta, std::numbers::pi / 2);
    board.write({{2, -40}, 2, true, true});
    EXPECT_NEAR(volts(output[0]), 2, 2e-4);
    EXPECT_NEAR(volts(output[1]), -10, 2e-4) << "the range is the limit";
    board.write({{2, 2}, 3, false, false});
    EXPECT_NEAR(volts(output[0]), 0, 2e-4);
    board.write({{2, 2}, 4, true, true});
    *fake.at<int>("fake_failing") = 1;
    EXPECT_FALSE(board.read(r));
    EXPECT_FALSE(board.connected());
    *fake.at<int>("fake_failing") = 0;
  }
  EXPECT_NEAR(volts(output[0]), 0, 2e-4);
  EXPECT_EQ(*fake.at<int>("fake_open"), 0);
}

TEST_F(ComediBoardTest, AFailedTransferLosesTheBoardWithItsReason) {
  int* failing = fake.at<int>("fake_failing");
  for (const bool reads : {true, false}) {
    ComediBoard board(options);
    BoardReading r;
    EXPECT_EQ(board.failure(), "");
    *failing = 1;
    if (reads) {
      EXPECT_FALSE(board.read(r));
    } else {
      board.write({{1, 1}, 1, true, true});
    }
    *failing = 0;
    for (int k = 0; k < 100; ++k) board.read(r);
    EXPECT_FALSE(board.connected());
    EXPECT_EQ(board.loss(), kBoardLost);
    EXPECT_EQ(board.failure(),
              reads ? "comedi /dev/comedi0: reading an input failed" : "comedi /dev/comedi0: writing an output failed");
    board.write({{1, 1}, 2, true, true});
    EXPECT_NEAR(volts(output[0]), 0, 2e-4) << "no more force";
  }
}

TEST_F(ComediBoardTest, WhatDoesNotOpenIsNamed) {
  options.inputs[3] = 9;
  EXPECT_THAT(testing::error_of([&] { ComediBoard{options}; }), HasSubstr("has no channel 9"));
  options.device = "/dev/comedi9";
  EXPECT_THAT(testing::error_of([&] { ComediBoard{options}; }), HasSubstr("/dev/comedi9"));
}

}  // namespace
}  // namespace whirl::rt
